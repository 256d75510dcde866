// Damaged block files end in an error that names the file, never in a crash or in a scene that leads outside of its arrays.
// Meant to be run with the sanitizers as well.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <random>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "fault/decode_damaged.hpp"
#include "raypager/sky.hpp"
#include "residency/transcode.hpp"
#include "store/check_scene.hpp"
#include "store/format.hpp"
#include "support/failing_file_system.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

class DamagedBlockFile : public testing::Test {
protected:
    using Header = format::Header;

    void SetUp() override {
        Scene scene =
            scene_of({mesh_shape(terrain(40)), mesh_shape(soup(200, 1)), sphere_shape({0, 1, 0}, 0.1f), cloud_shape(random_points(1500, 2))});
        scene.area_lights = {{{5, 5, 5}, false}};
        scene.shapes[2].area_light = 0;
        ASSERT_TRUE(set_sky(scene, {6, 6, 3, std::vector<float>(108, 0.5f)}).ok());
        bake_and_open(scene, path_, 16 << 10, 4, position_error_);
        auto text = read_text(path_);
        ASSERT_TRUE(text.ok());
        good_ = *text;
        std::memcpy(&header_, good_.data(), sizeof header_);
    }

    Result<std::shared_ptr<const BlockFile>> open(const std::string& bytes) {
        EXPECT_TRUE(write_text(damaged_, bytes).ok());
        return BlockFile::open(damaged_);
    }

    void expect_refused(const std::string& bytes, const std::string& because = "") {
        const auto file = open(bytes);
        ASSERT_FALSE(file.ok());
        const std::string& message = file.status().message();
        EXPECT_NE(message.find("damaged.rpb"), std::string::npos) << message;
        EXPECT_NE(message.find(because), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }

    // Makes all checksums of the header right again.
    std::string sealed(std::string bytes) const {
        Header header;
        std::memcpy(&header, bytes.data(), sizeof header);
        for (auto& section : header.sections) {
            const auto all = std::as_bytes(std::span(bytes));
            if (section.offset <= all.size() && section.count * section.item_bytes <= all.size() - section.offset)
                section.checksum = hash64(all.subspan(section.offset, section.count * section.item_bytes));
        }
        header.checksum = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)));
        std::memcpy(bytes.data(), &header, sizeof header);
        return bytes;
    }

    std::string with_header(const std::function<void(Header&)>& change) const {
        Header header = header_;
        change(header);
        std::string bytes = good_;
        std::memcpy(bytes.data(), &header, sizeof header);
        return bytes;
    }

    // The file with one item of a section changed, checksums right.
    template <class T>
    std::string with_item(format::Section section, size_t index, const std::function<void(T&)>& change) const {
        std::string bytes = good_;
        char* place = bytes.data() + header_.sections[section].offset + index * sizeof(T);
        T item;
        std::memcpy(&item, place, sizeof item);
        change(item);
        std::memcpy(place, &item, sizeof item);
        return sealed(bytes);
    }

    float position_error_ = 0;
    TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "good.rpb", damaged_ = folder_ / "damaged.rpb";
    std::string good_;
    Header header_ = {};
};

TEST_F(DamagedBlockFile, TheGoodOneIsAccepted) {
    EXPECT_TRUE(open(good_).ok());
    EXPECT_TRUE(open(sealed(good_)).ok());
}

TEST_F(DamagedBlockFile, Absent) {
    const auto file = BlockFile::open(folder_ / "absent.rpb");
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.status().message().find("absent.rpb"), std::string::npos);
}

TEST_F(DamagedBlockFile, TruncatedAnywhere) {
    std::vector<uint64_t> sizes = {
        0, 1, 7, 8, sizeof(Header) - 1, sizeof(Header), format::page - 1, format::page, format::page + 1, good_.size() - 1};
    for (const auto& section : header_.sections) {
        const uint64_t end = section.offset + section.count * section.item_bytes;
        for (const uint64_t size : {section.offset - 1, section.offset, section.offset + 1, end - 1, end})
            if (size < good_.size()) sizes.push_back(size);
    }
    for (const uint64_t size : sizes) {
        SCOPED_TRACE(size);
        expect_refused(good_.substr(0, size));
        // Even with a header that knows the new size.
        if (size < format::page || size == good_.size()) continue;
        std::string bytes = with_header([&](Header& header) { header.file_bytes = size; });
        bytes.resize(size);
        expect_refused(sealed(bytes));
    }
    expect_refused(good_ + "x", "should have");
}

TEST_F(DamagedBlockFile, WrongKind) {
    expect_refused("", "only 0 bytes");
    expect_refused("ply\nformat ascii 1.0\n");
    expect_refused(std::string(10000, '\x89'), "does not begin with");
    expect_refused(with_header([](Header& header) { header.magic[0] = 'r'; }), "does not begin with");
    expect_refused(with_header([](Header& header) { header.version++; }), fmt::format("version {}", format::version + 1));
    expect_refused(with_header([](Header& header) { header.endian_mark = 0x04030201; }), "byte order");
}

TEST_F(DamagedBlockFile, HugeCounts) {
    for (uint32_t section = 0; section < format::section_count; section++) {
        for (const uint64_t huge : {UINT64_MAX, uint64_t{1} << 63, uint64_t{1} << 41, uint64_t{1} << 60}) {
            SCOPED_TRACE(testing::Message() << format::section_names[section] << " " << huge);
            expect_refused(sealed(with_header([&](Header& header) { header.sections[section].count = huge; })), format::section_names[section]);
            expect_refused(sealed(with_header([&](Header& header) { header.sections[section].offset = huge; })), format::section_names[section]);
            expect_refused(sealed(with_header([&](Header& header) { header.sections[section].item_bytes = static_cast<uint32_t>(huge >> 32); })),
                           format::section_names[section]);
        }
    }
}

TEST_F(DamagedBlockFile, FlippedBitsAreNoticed) {
    constexpr uint32_t seed = 99;
    std::mt19937 random(seed);
    const auto opened = BlockFile::open(path_);
    ASSERT_TRUE(opened.ok());
    const auto in_use = [&](uint64_t at) {
        if (at < sizeof(Header)) return true;
        for (const auto& section : header_.sections)
            if (at >= section.offset && at < section.offset + section.count * section.item_bytes) return true;
        for (const BlockRecord& block : (*opened)->scene().blocks)
            if (at >= block.offset && at < block.offset + block.stored_bytes) return true;
        return false;  // between sections: nobody reads it
    };
    for (int trial = 0; trial < 400; trial++) {
        const uint64_t at = trial % 4 == 0 ? random() % sizeof(Header) : random() % good_.size();
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", byte " << at);
        std::string bytes = good_;
        bytes[at] ^= static_cast<char>(1 << random() % 8);
        const auto file = open(bytes);
        if (!file.ok()) {
            EXPECT_NE(file.status().message().find("damaged.rpb"), std::string::npos);
            continue;
        }
        int refused = 0;
        for (uint32_t block = 0; block < (*file)->scene().blocks.size(); block++) {
            std::vector<std::byte> stored((*file)->scene().blocks[block].stored_bytes);
            const Status status = (*file)->read_block(block, stored);
            if (status.ok()) continue;
            refused++;
            EXPECT_NE(status.message().find("damaged.rpb: block " + std::to_string(block)), std::string::npos) << status.message();
        }
        EXPECT_EQ(refused, in_use(at) ? 1 : 0);
    }
}

// Values that make no sense although every checksum is right.
TEST_F(DamagedBlockFile, NonsenseIsRefused) {
    using namespace format;
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.eye[1] = NAN; }), "scene");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.width = 0; }), "scene");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.projection = 4; }), "projection");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.lens_radius = -1; }), "lens");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.lens_radius = 1, s.focal_distance = NAN; }), "in focus");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.window[2] = 0; }), "window");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.filter_kind = 5; }), "pixel filter");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.filter_radius[1] = 0; }), "pixel filter");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.filter_kind = 2, s.filter_parameters[0] = NAN; }), "pixel filter");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.exposure = -1; }), "film");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.exposure = INFINITY; }), "film");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.color_matrix[4] = NAN; }), "film");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.max_luminance = NAN; }), "film");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.max_xyz = -1; }), "film");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.lower[0] = s.upper[0] + 1; }), "scene");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.triangles++; }), "");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.triangles = UINT64_MAX; }), "too many");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.top_grid.cell[2] = 0; }), "grid");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.top_grid.cell[2] = 1e35f; }), "grid");  // planes that are not finite
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.top_grid.origin[0] = -1e30f; }), "grid");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.upper[1] = 1e20f; }), "bounds");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.top_grid.root = 1; }), "top tree");
    expect_refused(with_item<Scalars>(scalars, 0, [](Scalars& s) { s.top_grid.root = RP_REF_EXIT; }), "top tree");
    expect_refused(with_item<rp_material>(materials, 0, [](rp_material& m) { m.kind = 17; }), "material 0");
    expect_refused(with_item<rp_light>(lights, 0, [](rp_light& l) { l.kind = 17; }), "light 0");
    expect_refused(with_item<rp_light>(lights, 0, [](rp_light& l) { l.probability = 0.5f; }), "probabilities");
    expect_refused(with_item<rp_light>(lights, 0, [](rp_light& l) { l.flags = 4; }), "light 0");
    expect_refused(with_item<rp_light>(lights, 0, [](rp_light& l) { l.flags |= RP_LIGHT_UNSEEN; }), "lights of another kind");
    expect_refused(with_item<rp_light>(lights, 0, [](rp_light& l) { l.kind = RP_LIGHT_POINT; }), "lights of another kind");
    expect_refused(with_item<rp_light>(lights, 1, [](rp_light& l) { l.flags = 2u << RP_LIGHT_IMAGE_SHIFT; }), "light images");
    expect_refused(with_item<rp_light>(lights, 1, [](rp_light& l) { l.e1[1] = 0.5f; }), "light images");
    expect_refused(with_item<rp_light>(lights, 1, [](rp_light& l) { l.kind = RP_LIGHT_DISTANT; }), "light images");
    expect_refused(with_item<rp_light_image>(light_images, 0, [](rp_light_image& i) { i.width = 5; }), "texels");
    expect_refused(with_item<rp_light_image>(light_images, 0, [](rp_light_image& i) { i.width = 0; }), "texels");
    expect_refused(with_item<rp_light_image>(light_images, 0, [](rp_light_image& i) { i.width = i.height = UINT32_MAX; }), "texels");
    expect_refused(with_item<rp_light_image>(light_images, 0, [](rp_light_image& i) { i = {9, 4}; }), "light images");
    expect_refused(with_item<rp_texel>(texels, 35, [](rp_texel& t) { t.blue_exponent = 0; }), "light images");
    expect_refused(with_item<rp_texel>(texels, 35, [](rp_texel& t) { t.blue_exponent = 255u << 16; }), "light images");
    expect_refused(with_item<rp_primitive_range>(ranges, 0, [](rp_primitive_range& r) { r.first_primitive = 1; }), "range 0");
    expect_refused(with_item<rp_primitive_range>(ranges, 0, [](rp_primitive_range& r) { r.material = 1; }), "material");
    expect_refused(with_item<rp_primitive_range>(ranges, 1, [](rp_primitive_range& r) { r.first_light = 1; }), "lights");
    expect_refused(with_item<rp_primitive_range>(ranges, 1, [](rp_primitive_range& r) { r.flags = 8; }), "flags");
    expect_refused(with_item<rp_primitive_range>(ranges, 1, [](rp_primitive_range& r) { r.flags = RP_RANGE_POINT_COLOR | RP_RANGE_UV; }), "flags");
    expect_refused(with_item<rp_primitive_range>(ranges, 1, [](rp_primitive_range& r) { r.flags = RP_RANGE_POINT_COLOR | RP_RANGE_VERTEX_COLOR; }),
                   "flags");
    expect_refused(with_item<rp_node>(top_nodes, 0, [](rp_node& n) { n.child[1].y = RP_BOX_ABSENT; }), "boxes of node 0");
    expect_refused(with_item<rp_node>(top_nodes, 0, [](rp_node& n) { n.child[1].ref = 0; }), "top tree");
    expect_refused(with_item<rp_node>(top_nodes, 0, [](rp_node& n) { n.child[0].ref = RP_REF_LEAF; }), "top tree");
    expect_refused(with_item<rp_node>(top_nodes, 0, [](rp_node& n) { std::swap(n.child[0].ref, n.child[1].ref); }), "top tree");
    expect_refused(with_item<rp_node>(top_nodes, 0, [](rp_node& n) { n.child[0].ref = RP_REF_BLOCK_ENTRY | 0x3ffffff0u; }), "block entry");
    expect_refused(with_item<uint64_t>(block_entry_paths, 0, [](uint64_t& path) { path ^= 1; }), "path of block entry 0");
    expect_refused(with_item<rp_block_entry>(block_entries, 0, [](rp_block_entry& p) { p.block = 1; }), "block entry 0");
    expect_refused(with_item<rp_block_entry>(block_entries, 1, [](rp_block_entry& p) { p.root = 0x7fffffff; }), "block entry 1");
    expect_refused(with_item<rp_block_entry>(block_entries, 1, [](rp_block_entry& p) { p.root = RP_REF_BLOCK_ENTRY; }), "block entry 1");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.offset += 64; }), "block 0");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.offset = UINT64_MAX - 4095; }), "block 0");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.stored_bytes = UINT32_MAX; }), "block 0");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.wide_bytes = 0; }), "block 0");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.wide_bytes += 4; }), "block 0");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.wide_bytes = 2 * RP_MAX_WIDE_BYTES; }), "block 0");
    expect_refused(with_item<rp_u32>(wide_roots, 1, [](rp_u32& root) { root = UINT32_MAX; }), "block entry 1");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.triangles++; }), "");
    expect_refused(with_item<BlockRecord>(blocks, 0, [](BlockRecord& b) { b.lower[0] = INFINITY; }), "block 0");
}

// Random changes with right checksums: whatever open() accepts must be safe to walk.
TEST_F(DamagedBlockFile, RandomChangesUnderRightChecksums) {
    constexpr uint32_t seed = 100;
    std::mt19937 random(seed);
    for (int trial = 0; trial < 400; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        std::string bytes = good_;
        const auto& section = header_.sections[random() % format::section_count];
        if (section.count == 0) continue;
        for (uint32_t i = 0; i < 1 + random() % 3; i++)
            bytes[section.offset + random() % (section.count * section.item_bytes)] = static_cast<char>(random());
        const auto file = open(sealed(bytes));
        if (!file.ok()) {
            EXPECT_NE(file.status().message().find("damaged.rpb"), std::string::npos);
            continue;
        }
        for (uint32_t block = 0; block < (*file)->scene().blocks.size(); block++) {
            const BlockRecord& record = (*file)->scene().blocks[block];
            if (std::max(record.stored_bytes, record.wide_bytes) > good_.size() * 4) continue;  // takes long, and shows no more
            std::vector<std::byte> room(std::max(record.stored_bytes, record.wide_bytes));
            const auto stored = std::span(room).first(record.stored_bytes);
            if ((*file)->read_block(block, stored).ok() && (*file)->check_block(block, stored).ok())
                (void)transcode_block((*file)->scene(), block, BlockForm::wide, room).ok();
        }
    }
}

// With positions and ids that are coded.
class DamagedCodedBlocks : public DamagedBlockFile {
protected:
    DamagedCodedBlocks() { position_error_ = 1e-3f; }
};

TEST_F(DamagedBlockFile, ChecksOfBlocksMakeDecodingSafe) { decode_damaged_blocks(path_, 101); }
TEST_F(DamagedCodedBlocks, ChecksOfBlocksMakeDecodingSafe) { decode_damaged_blocks(path_, 103); }

// Positions are coded only in scenes that say so.
TEST_F(DamagedBlockFile, ChecksOfBlocksKnowCodes) {
    const auto file = BlockFile::open(path_);
    ASSERT_TRUE(file.ok());
    AlignedBytes bytes = read_block(**file, 0);
    const rp_u32 flags = 4u << RP_POSITION_STRIDE_SHIFT;
    std::memcpy(bytes.span().data() + offsetof(rp_block_header, flags), &flags, sizeof flags);
    const Status status = (*file)->check_block(0, bytes.span());
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.message().find("coded"), std::string::npos) << status.message();
}

// What check_block says of the nodes above the block entries, by which rays enter a block as a whole.
TEST_F(DamagedBlockFile, ChecksOfBlocksKnowWhatIsAboveBlockEntries) {
    const auto file = BlockFile::open(path_);
    ASSERT_TRUE(file.ok());
    const BakedScene& scene = (*file)->scene();
    const auto block_entries = scene.block_entries_of(0).roots;
    ASSERT_EQ(block_entries.size(), 4u);
    const auto refused = [&](uint64_t node, int side, rp_u32 ref, const char* because) {
        AlignedBytes damaged = read_block(**file, 0);
        const uint64_t at =
            sizeof(rp_block_header) + node * sizeof(rp_node) + static_cast<uint64_t>(side) * sizeof(rp_child) + offsetof(rp_child, ref);
        std::memcpy(damaged.span().data() + at, &ref, sizeof ref);
        const Status status = (*file)->check_block(0, damaged.span());
        ASSERT_FALSE(status.ok()) << because;
        EXPECT_NE(status.message().find(because), std::string::npos) << status.message();
    };
    for (uint64_t node = 0; node < block_entries.size() - 1; node++) {
        for (const int side : {0, 1}) {
            refused(node, side, 0, "above its block entries");                          // a cycle
            refused(node, side, static_cast<rp_u32>(node), "above its block entries");  // a shorter one
            refused(node, side, block_entries[0] + 1, "above its block entries");       // past a block entry
            refused(node, side, RP_REF_LEAF, "above its block entries");                // to a leaf
            refused(node, side, RP_REF_BLOCK_ENTRY, "above its block entries");         // out of the block
        }
    }
}

// What check_block says of a leaf of spheres or points that was changed.
TEST_F(DamagedBlockFile, ChecksOfBlocksKnowSpheres) {
    const auto file = BlockFile::open(path_);
    ASSERT_TRUE(file.ok());
    const BakedScene& scene = (*file)->scene();
    uint32_t block = 0;
    while (block < scene.blocks.size() && scene.blocks[block].spheres < 50) block++;
    ASSERT_LT(block, scene.blocks.size()) << "no block with a cloud";
    AlignedBytes bytes = read_block(**file, block);
    const BlockView view(bytes.span());
    // A leaf of spheres beneath some node.
    size_t node = 0, side = 0;
    const auto is_spheres = [](rp_u32 ref) { return (ref & RP_REF_LEAF) && (ref & RP_LEAF_SPHERES); };
    while (!is_spheres(view.nodes[node].child[side].ref)) side = (side + 1) % 2, node += side == 0;
    const auto refused = [&](uint64_t at, rp_u32 change, const char* because) {
        AlignedBytes damaged = bytes;
        rp_u32 word;
        std::memcpy(&word, damaged.span().data() + at, sizeof word);
        word ^= change;
        std::memcpy(damaged.span().data() + at, &word, sizeof word);
        const Status status = (*file)->check_block(block, damaged.span());
        ASSERT_FALSE(status.ok()) << because;
        EXPECT_NE(status.message().find(because), std::string::npos) << status.message();
    };
    const uint64_t ref = view.header.nodes_at + node * sizeof(rp_node) + side * sizeof(rp_child) + offsetof(rp_child, ref);
    refused(ref, 0x10, "spheres");                              // a bit that must be clear
    refused(ref, 1, "spheres");                                 // another number of spheres
    refused(ref, 1u << RP_LEAF_INDEX_SHIFT, "spheres");         // another first one
    refused(ref, 0x400000u << RP_LEAF_INDEX_SHIFT, "spheres");  // one beyond the end
    const uint64_t sphere = view.header.spheres_at, id = sphere + view.header.sphere_count * sizeof(rp_sphere);
    const rp_u32 x = std::bit_cast<rp_u32>(view.spheres[0].center[0]);
    refused(sphere, ~x & 0x7f800000u, "not finite");
    refused(sphere, x ^ std::bit_cast<rp_u32>(1e20f), "too far away");
    refused(id, 0x80000000u, "does not exist");
    refused(id + 4 * (view.header.sphere_count - 1), 0x80000000u, "does not exist");
    // An infinite radius, and the code that is not used.
    refused(sphere + offsetof(rp_sphere, word), ~view.spheres[0].word & 0x7f8000ffu, "radius");
}

// Failing reads and full disks.
TEST_F(DamagedBlockFile, InjectedFaults) {
    support::FailingFileSystem disk;
    for (int n = 1; n <= 12; n++) {
        disk.error_number = EIO;
        disk.fail_read_in = n;
        const auto file = BlockFile::open(path_);
        const bool fired = disk.fail_read_in == 0;
        disk.fail_read_in = 0;
        EXPECT_EQ(file.ok(), !fired) << n;
    }
    const Scene scene = scene_of({mesh_shape(terrain(300))});
    bool finished = false;
    for (int n = 1; n <= 64 && !finished; n++) {
        disk.error_number = ENOSPC;
        disk.fail_write_in = n;
        const auto summary = bake(scene, {}, folder_ / "full.rpb");
        const bool fired = disk.fail_write_in == 0;
        disk.fail_write_in = 0;
        EXPECT_EQ(summary.ok(), !fired) << n;
        EXPECT_EQ(std::filesystem::exists(folder_ / "full.rpb"), !fired) << n;
        finished = !fired;
    }
    EXPECT_TRUE(finished);
    // Short reads are completed, not believed.
    disk.error_number = 0;
    disk.fail_read_in = 2;
    EXPECT_TRUE(BlockFile::open(path_).ok());
}

}  // namespace
}  // namespace raypager
