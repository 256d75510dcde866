// Block files with images, damaged: nonsense is refused, a bad page is an error that names it, and no kernel can be led outside.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "raypager/sky.hpp"
#include "render/render.hpp"
#include "store/block_file.hpp"
#include "store/format.hpp"
#include "support/block_file_bytes.hpp"
#include "support/test_options.hpp"
#include "support/textured_scene.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

class DamagedPages : public ::testing::Test {
protected:
    void SetUp() override {
        bake_and_open(support::with_images(scene_of({mesh_shape(terrain(6))})), folder_ / "good.rpb", 16 << 10);
        good_ = support::read_file(folder_ / "good.rpb");
        std::memcpy(&header_, good_.data(), sizeof header_);
    }
    Result<std::shared_ptr<const BlockFile>> open(const std::string& bytes) { return BlockFile::open(folder_.write("damaged.rpb", bytes)); }
    template <class T, class Change>
    std::string changed(format::Section section, size_t index, const Change& change) const {
        std::string bytes = good_;
        T item;
        const size_t at = header_.sections[section].offset + index * sizeof item;
        std::memcpy(&item, bytes.data() + at, sizeof item);
        change(item);
        std::memcpy(bytes.data() + at, &item, sizeof item);
        support::seal_block_file(bytes);
        return bytes;
    }
    void expect_refused(const std::string& bytes, const std::string& words) {
        const auto file = open(bytes);
        ASSERT_FALSE(file.ok()) << words;
        EXPECT_NE(file.status().message().find("damaged.rpb"), std::string::npos) << file.status().message();
        EXPECT_NE(file.status().message().find(words), std::string::npos) << file.status().message();
    }

    TemporaryFolder folder_;
    std::string good_;
    format::Header header_;
};

TEST_F(DamagedPages, NonsenseIsRefused) {
    using namespace format;
    const auto bad_image = [&](const auto& change, const char* words) { expect_refused(changed<rp_image>(images, 1, change), words); };
    bad_image([](rp_image& i) { i.format = RP_TEXEL_FORMATS; }, "image 1 has texels of an unknown format");
    bad_image([](rp_image& i) { i.srgb = 2; }, "sRGB");
    bad_image([](rp_image& i) { i.format = RP_TEXEL_RGBA16; }, "sRGB");
    bad_image([](rp_image& i) { i.levels = 0; }, "levels");
    bad_image([](rp_image& i) { i.levels = UINT32_MAX; }, "levels");
    bad_image([](rp_image& i) { i.levels++; }, "level");
    bad_image([](rp_image& i) { i.first_level = UINT32_MAX; }, "levels");
    const auto bad_level = [&](size_t index, const auto& change, const char* words) {
        expect_refused(changed<rp_image_level>(image_levels, index, change), words);
    };
    bad_level(
        0, [](rp_image_level& l) { l.page = UINT32_MAX; }, "level 0 has tiles in pages that do not exist");
    bad_level(
        0, [](rp_image_level& l) { l.page = 1000; }, "pages that do not exist");
    bad_level(
        0, [](rp_image_level& l) { l.width = UINT32_MAX; }, "impossible size");
    bad_level(
        0, [](rp_image_level& l) { l.height = 0; }, "impossible size");
    bad_level(
        0, [](rp_image_level& l) { l.at = 0; }, "must be in tiles");
    bad_level(
        0, [](rp_image_level& l) { l.width = RP_IMAGE_MAX_SIZE, l.height = RP_IMAGE_MAX_SIZE; }, "");
    bad_level(
        1, [](rp_image_level& l) { l.width++; }, "not half as large");
    bad_level(
        3, [](rp_image_level& l) { l.at = RP_NONE; }, "level 3 does not lie within a page");
    bad_level(
        3, [](rp_image_level& l) { l.at += 4; }, "within a page");
    bad_level(
        3, [](rp_image_level& l) { l.at = RP_TEXTURE_PAGE_BYTES - 8; }, "within a page");
    bad_level(
        3, [](rp_image_level& l) { l.page = UINT32_MAX; }, "within a page");
    const auto bad_page = [&](const auto& change) { expect_refused(changed<PageRecord>(pages, 2, change), "page 2 does not lie within the file"); };
    bad_page([](PageRecord& p) { p.offset += 64; });
    bad_page([](PageRecord& p) { p.offset = 0; });
    bad_page([](PageRecord& p) { p.offset = UINT64_MAX - 4095; });
    const auto bad_op = [&](const auto& change) { expect_refused(changed<rp_texture_op>(texture_ops, 0, change), "texture operations"); };
    bad_op([](rp_texture_op& o) { o.op = 200; });
    bad_op([](rp_texture_op& o) { o.image = 5; });
    bad_op([](rp_texture_op& o) { o.lookup = UINT32_MAX; });
    bad_op([](rp_texture_op& o) { o.a[0] = NAN; });
    expect_refused(changed<rp_texture_map>(texture_maps, 0, [](rp_texture_map& m) { m.kind = 9; }), "coordinates 0");
    expect_refused(changed<rp_material>(materials, 0, [](rp_material& m) { m.flags = 3u << RP_MATERIAL_PROGRAM_SHIFT; }), "material 0");
}

TEST_F(DamagedPages, ABadPageIsNamed) {
    const auto good = open(good_);
    ASSERT_TRUE(good.ok()) << good.status().message();
    const PageRecord record = (*good)->scene().pages[3];
    std::string bytes = good_;
    bytes[record.offset + 777] ^= 4;
    const auto file = open(bytes);
    ASSERT_TRUE(file.ok()) << file.status().message();
    std::vector<std::byte> page(RP_TEXTURE_PAGE_BYTES);
    for (uint32_t i = 0; i < (*file)->scene().pages.size(); i++) {
        const Status status = (*file)->read_page(i, page);
        EXPECT_EQ(status.ok(), i != 3);
        if (i != 3) continue;
        const std::string place = fmt::format("damaged.rpb: page 3 of images at byte {}: the checksum is wrong", record.offset);
        EXPECT_NE(status.message().find(place), std::string::npos) << status.message();
    }
}

// Random changes with right checksums: whatever is accepted has all its texels in pages.
TEST_F(DamagedPages, RandomChangesUnderRightChecksums) {
    constexpr uint32_t seed = 7;
    std::mt19937 random(seed);
    const format::Section sections[] = {format::images, format::image_levels, format::pages, format::texture_ops, format::texture_maps};
    for (int trial = 0; trial < 300; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        std::string bytes = good_;
        const auto& section = header_.sections[sections[static_cast<size_t>(trial) % std::size(sections)]];
        for (uint32_t i = 0; i < 1 + random() % 2; i++)
            bytes[section.offset + random() % (section.count * section.item_bytes)] = static_cast<char>(random());
        support::seal_block_file(bytes);
        const auto file = open(bytes);
        if (!file.ok()) continue;
        const BakedScene& scene = (*file)->scene();
        for (const rp_image& image : scene.images)
            for (uint32_t l = image.first_level; l < image.first_level + image.levels; l++) {
                const rp_image_level& level = scene.image_levels[l];
                const uint64_t tiles = level.at == RP_NONE ? tiles_of(image.format, level.width, level.height) : 1;
                ASSERT_LE(level.page + tiles, scene.pages.size());
                const uint64_t end = level.at + uint64_t{level.width} * level.height * texel_bytes(image.format);
                ASSERT_TRUE(level.at == RP_NONE || end <= RP_TEXTURE_PAGE_BYTES);
            }
    }
}

TEST_F(DamagedPages, SqueezedAndSpreadItIsTheSame) {
    std::string spread = support::spread_pages(support::squeeze_pages(good_));
    EXPECT_EQ(spread, good_);
}

// Where the texels of a sky are in pages, what kernels read of it must lead nowhere else.
TEST_F(DamagedPages, NonsenseAboutASkyIsRefused) {
    Scene scene = support::with_images(scene_of({mesh_shape(terrain(6))}));
    ASSERT_TRUE(set_sky(scene, {70, 70, 1, std::vector<float>(4900, 0.5f)}).ok());
    BakeOptions options;
    options.resident_sky_bytes = 0;
    ASSERT_TRUE(bake(scene, options, folder_ / "sky.rpb").ok());
    good_ = support::read_file(folder_ / "sky.rpb");
    std::memcpy(&header_, good_.data(), sizeof header_);
    ASSERT_TRUE(open(good_).ok());
    const auto bad_word = [&](size_t index, const auto& change, const char* words) {
        expect_refused(changed<rp_u32>(format::sky_words, index, change), words);
    };
    bad_word(
        RP_IMAGE_WIDTH, [](rp_u32& w) { w = 71; }, "another size");
    bad_word(
        RP_IMAGE_CELLS, [](rp_u32& w) { w = 0; }, "cannot be drawn");
    bad_word(
        RP_IMAGE_CELLS, [](rp_u32& w) { w = 1u << 20; }, "cannot be drawn");
    bad_word(
        RP_IMAGE_IN_PAGES, [](rp_u32& w) { w--; }, "not the last one");
    bad_word(
        RP_IMAGE_LEVEL, [](rp_u32& w) { w = 8; }, "no such level");
    bad_word(
        RP_IMAGE_HEAD + 5, [](rp_u32& w) { w = 0; }, "cannot be drawn");
    bad_word(
        RP_IMAGE_HEAD + 69, [](rp_u32& w) { w--; }, "cannot be drawn");
    const size_t last = header_.sections[format::images].count - 1;
    const auto sky_format = [](rp_image& i) { i.format = RP_TEXEL_SKY; };
    expect_refused(changed<rp_image>(format::images, last, [](rp_image& i) { i.format = RP_TEXEL_RGBA_HALF; }), "unknown format");
    expect_refused(changed<rp_image>(format::images, 0, sky_format), "unknown format");
    // Programs do not read it.
    expect_refused(changed<rp_texture_op>(format::texture_ops, 0, [&](rp_texture_op& op) { op.image = static_cast<rp_u32>(last); }),
                   "does not exist");
    // Without these words its texels are missing.
    std::string without = good_;
    std::memcpy(&header_, without.data(), sizeof header_);
    header_.sections[format::sky_words].count = 0;
    header_.sections[format::sky_words].checksum = hash64(std::string_view());
    std::memcpy(without.data(), &header_, sizeof header_);
    support::seal_block_file(without);
    expect_refused(without, "texels");
}

}  // namespace
}  // namespace raypager
