// Damaged blocks with coordinates of textures.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "fault/decode_damaged.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

class DamagedTexturedBlocks : public testing::Test {
protected:
    void SetUp() override {
        Scene scene = scene_of({mesh_shape(with_uvs(terrain(40))), mesh_shape(soup(200, 1)), cloud_shape(random_points(1500, 2))});
        scene.shapes[0].material = add_textured_gray(scene);
        bake_and_open(scene, path_, 16 << 10, 4);
    }

    TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "good.rpb";
};

TEST_F(DamagedTexturedBlocks, ChecksOfBlocksMakeDecodingSafe) { decode_damaged_blocks(path_, 105); }

TEST_F(DamagedTexturedBlocks, ChecksOfBlocksKnowCoordinatesOfTextures) {
    const auto file = BlockFile::open(path_);
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE((*file)->scene().has_uvs());
    const AlignedBytes good = read_block(**file, 0);
    const auto refused = [&](uint64_t at, const auto& change, const char* because) {
        AlignedBytes damaged = good;
        rp_u32 word;
        std::memcpy(&word, damaged.span().data() + at, sizeof word);
        word = change(word);
        std::memcpy(damaged.span().data() + at, &word, sizeof word);
        const Status status = (*file)->check_block(0, damaged.span());
        ASSERT_FALSE(status.ok()) << because;
        EXPECT_NE(status.message().find(because), std::string::npos) << status.message();
    };
    const rp_block_header header = BlockView(AlignedBytes(good).span()).header;
    ASSERT_TRUE(RP_BLOCK_HAS_UVS(header.attributes_at));
    const uint64_t place = offsetof(rp_block_header, attributes_at);
    refused(
        place, [](rp_u32 at) { return at - RP_BLOCK_UVS; }, "coded");
    refused(
        place, [](rp_u32) { return RP_BLOCK_UVS; }, "coded");
    refused(
        place, [](rp_u32 at) { return at + RP_BLOCK_INSTANCES; }, "instances");
    refused(
        place, [](rp_u32 at) { return at + 4; }, "attributes");
    refused(
        place, [](rp_u32 at) { return at + 64; }, "attributes");
    refused(
        place, [](rp_u32 at) { return at - 16; }, "attributes");
    refused(
        place, [](rp_u32 at) { return at | 0x80000000u; }, "attributes");
    const uint64_t first = RP_BLOCK_ATTRIBUTES_AT(header.attributes_at), last = first + header.vertex_count * sizeof(Float2) - sizeof(float);
    for (const uint64_t at : {first, last})
        for (const float value : {NAN, INFINITY, -1e30f})
            refused(
                at, [&](rp_u32) { return std::bit_cast<rp_u32>(value); }, "coordinates");
}

// Kernels of a scene without any do not know of them.
TEST(DamagedBlocks, HaveNoCoordinatesOfTexturesWhereTheSceneHasNone) {
    const TemporaryFolder folder;
    const auto file = bake_and_open(scene_of({mesh_shape(terrain(10))}), folder / "plain.rpb", 16 << 10);
    AlignedBytes bytes = read_block(*file, 0);
    rp_block_header header;
    std::memcpy(&header, bytes.span().data(), sizeof header);
    header.attributes_at = header.nodes_at | RP_BLOCK_UVS;
    std::memcpy(bytes.span().data(), &header, sizeof header);
    const Status status = file->check_block(0, bytes.span());
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.message().find("no part of the scene"), std::string::npos) << status.message();
}

}  // namespace
}  // namespace raypager
