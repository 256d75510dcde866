// The wide form of blocks and of the top tree: what lies in the stored form lies in the wide one, once and exactly, and every promise of
// abi/wide.h holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <random>

#include "block/wide_block.hpp"
#include "block/wide_node.hpp"
#include "block/wide_top.hpp"
#include "residency/transcode.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

constexpr uint32_t seed = 20261121;

template <class T>
T at(std::span<const std::byte> bytes, size_t offset) {
    T value;
    EXPECT_LE(offset + sizeof(T), bytes.size());
    if (offset + sizeof(T) > bytes.size()) return {};
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

// What a subtree of a wide tree holds, read as abi/wide.h says.
class WideReader {
public:
    // block entries: of the top tree.
    WideReader(std::span<const std::byte> bytes, uint32_t block, std::span<const rp_wide_block_entry> block_entries = {})
        : bytes_(bytes), block_entries_(block_entries), block_(block) {}

    // Returns the bounds of what is beneath a root; checks all boxes on the way.
    Box read(rp_u32 root) { return record(size_t{root >> 1} * RP_WIDE_UNIT, root & 1, 0); }

    DecodedLeaf found;
    std::vector<rp_u32> block_entries_found;
    std::vector<rp_u32> block_entry_roots;  // in the order of block_entries_found
    size_t record_bytes = 0;

private:
    Box record(size_t offset, bool is_leaf, int depth) {
        EXPECT_EQ(offset % RP_WIDE_UNIT, 0u);
        EXPECT_LE(depth, RP_WIDE_MAX_DEPTH);
        if (is_leaf) return leaf(offset);
        const auto node = at<rp_wide_node>(bytes_, offset);
        record_bytes += sizeof node;
        EXPECT_GE(node.count, 2u);
        Box bounds;
        size_t child = offset + size_t{node.children} * RP_WIDE_UNIT;
        for (uint32_t k = 0; k < node.count; k++) {
            const Box inside = record(child, node.leaves >> k & 1, depth + 1), box = stored_box(node, k);
            for (int a = 0; a < 3; a++) {
                // Bounds of block entries have their slack already.
                EXPECT_TRUE(block_entries_.empty() ? box.lower[a] < inside.lower[a] : box.lower[a] <= inside.lower[a]);
                EXPECT_TRUE(block_entries_.empty() ? box.upper[a] > inside.upper[a] : box.upper[a] >= inside.upper[a]);
            }
            bounds.grow(inside);
            child += size_t{node.size[k]} * RP_WIDE_UNIT;
        }
        return bounds;
    }

    Box leaf(size_t offset) {
        const auto head = at<rp_wide_leaf>(bytes_, offset);
        offset += sizeof head;
        if (head.kind == RP_WIDE_BLOCK_ENTRY) {
            const auto block_entry = at<rp_u32>(bytes_, offset + 4);
            EXPECT_LT(block_entry, block_entries_.size());
            if (block_entry >= block_entries_.size()) return {};
            block_entry_roots.push_back(at<rp_u32>(bytes_, offset));
            block_entries_found.push_back(block_entry);
            EXPECT_EQ(head.block, block_entries_[block_entry].block);
            Box bounds;
            bounds.grow(Float3{block_entries_[block_entry].lower[0], block_entries_[block_entry].lower[1], block_entries_[block_entry].lower[2]});
            bounds.grow(Float3{block_entries_[block_entry].upper[0], block_entries_[block_entry].upper[1], block_entries_[block_entry].upper[2]});
            return bounds;
        }
        EXPECT_EQ(head.block, block_);
        return head.kind == RP_WIDE_TRIANGLES ? triangles(head, offset) : spheres(head, offset + 8);
    }

    Box triangles(const rp_wide_leaf& head, size_t offset) {
        const size_t n = head.vertices, corners = offset + 12 * n, ids = corners + (3 * size_t{head.count} + 3) / 4 * 4;
        const size_t normals = ids + 4 * size_t{head.count};
        const size_t colors = normals + (head.flags & RP_WIDE_NORMALS ? 4 * n : 0);
        const size_t uvs = colors + (head.flags & RP_WIDE_COLORS ? 4 * n : 0);
        record_bytes += uvs + (head.flags & RP_WIDE_UVS ? 8 * n : 0) - offset + sizeof head;
        Box bounds;
        for (uint32_t k = 0; k < head.count; k++) {
            DecodedTriangle triangle;
            triangle.id = at<rp_u32>(bytes_, ids + 4 * k);
            for (uint32_t i = 0; i < 3; i++) {
                const size_t v = at<rp_u8>(bytes_, corners + i * head.count + k);
                EXPECT_LT(v, n);
                triangle.vertices[i] = {at<float>(bytes_, offset + 4 * v), at<float>(bytes_, offset + 4 * (n + v)),
                                        at<float>(bytes_, offset + 4 * (2 * n + v))};
                triangle.normals[i] = head.flags & RP_WIDE_NORMALS ? at<rp_u32>(bytes_, normals + 4 * v) : RP_NONE;
                triangle.colors[i] = head.flags & RP_WIDE_COLORS ? at<rp_u32>(bytes_, colors + 4 * v) : RP_NONE;
                if (head.flags & RP_WIDE_UVS) triangle.uvs[i] = {at<float>(bytes_, uvs + 4 * v), at<float>(bytes_, uvs + 4 * (n + v))};
                bounds.grow(triangle.vertices[i]);
            }
            found.triangles.push_back(triangle);
        }
        return bounds;
    }

    Box spheres(const rp_wide_leaf& head, size_t offset) {
        Box bounds;
        record_bytes += 16 + 20 * size_t{head.count};
        for (uint32_t k = 0; k < head.count; k++) {
            const auto sphere = at<rp_sphere>(bytes_, offset + sizeof(rp_sphere) * k);
            DecodedSphere decoded;
            decoded.id = at<rp_u32>(bytes_, offset + sizeof(rp_sphere) * head.count + 4 * k);
            decoded.center = {sphere.center[0], sphere.center[1], sphere.center[2]};
            decoded.point_word = head.flags & RP_WIDE_POINTS ? sphere.word : RP_NONE;
            if (!(head.flags & RP_WIDE_POINTS)) std::memcpy(&decoded.radius, &sphere.word, sizeof decoded.radius);
            bounds.grow(decoded.center);
            found.spheres.push_back(decoded);
        }
        return bounds;
    }

    std::span<const std::byte> bytes_;
    std::span<const rp_wide_block_entry> block_entries_;
    uint32_t block_;
};

std::vector<std::byte> wide_form(const BlockFile& file, uint32_t block) {
    AlignedBytes stored = read_block(file, block);
    std::vector<std::byte> bytes(std::max(file.scene().blocks[block].stored_bytes, file.scene().blocks[block].wide_bytes));
    std::ranges::copy(stored.span(), bytes.begin());
    const Status status = transcode_block(file.scene(), block, BlockForm::wide, bytes);
    EXPECT_TRUE(status.ok()) << status.message();
    bytes.resize(file.scene().blocks[block].wide_bytes);
    return bytes;
}

template <class T>
void sort_by_id(std::vector<T>& items) {
    std::ranges::sort(items, {}, &T::id);
}

// A triangle's corners and their attributes, turned so that the least corner comes first: orientation is kept.
using CanonicalTriangle = std::array<std::array<double, 7>, 3>;
CanonicalTriangle canonical(const DecodedTriangle& t) {
    CanonicalTriangle corners;
    for (int i = 0; i < 3; i++) {
        const Float3& v = t.vertices[i];
        corners[i] = {v.x, v.y, v.z, double(t.normals[i]), double(t.colors[i]), t.uvs[i].x, t.uvs[i].y};
    }
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    return corners;
}

TEST(WideBlocks, HoldEveryPrimitiveOnceAndExactly) {
    TemporaryFolder folder;
    const auto file = bake_and_open(mixed_scene(seed), folder / "scene.rpb", 40 << 10, 8);
    const BakedScene& scene = file->scene();
    ASSERT_GT(scene.blocks.size(), 4u);
    for (uint32_t block = 0; block < scene.blocks.size(); block++) {
        const std::vector<std::byte> bytes = wide_form(*file, block);
        const auto header = at<rp_wide_header>(bytes, 0);
        ASSERT_EQ(header.magic, RP_WIDE_MAGIC);
        ASSERT_EQ(header.bytes, bytes.size());
        ASSERT_EQ(header.block, block);
        AlignedBytes stored = read_block(*file, block);
        const BlockView view(stored.span());
        const BlockEntryRoots block_entries = scene.block_entries_of(block);
        ASSERT_FALSE(block_entries.roots.empty());
        for (size_t p = 0; p < block_entries.roots.size(); p++) {
            DecodedLeaf expected = decode_subtree(view, block_entries.roots[p]);
            WideReader reader(bytes, block);
            reader.read(block_entries.wide_roots[p]);
            sort_by_id(expected.triangles);
            sort_by_id(expected.spheres);
            sort_by_id(reader.found.triangles);
            sort_by_id(reader.found.spheres);
            ASSERT_EQ(reader.found.triangles.size(), expected.triangles.size());
            ASSERT_EQ(reader.found.spheres.size(), expected.spheres.size());
            for (size_t i = 0; i < expected.triangles.size(); i++) {
                ASSERT_EQ(reader.found.triangles[i].id, expected.triangles[i].id);
                ASSERT_EQ(canonical(reader.found.triangles[i]), canonical(expected.triangles[i])) << "triangle " << expected.triangles[i].id;
            }
            for (size_t i = 0; i < expected.spheres.size(); i++) {
                const DecodedSphere &have = reader.found.spheres[i], &request = expected.spheres[i];
                ASSERT_EQ(have.id, request.id);
                ASSERT_EQ(have.center, request.center);
                ASSERT_EQ(have.point_word, request.point_word);
                if (request.point_word == RP_NONE) {
                    ASSERT_EQ(have.radius, request.radius);
                }
            }
        }
    }
}

TEST(WideBlocks, DoNotDependOnWhatWasMadeBefore) {
    TemporaryFolder folder;
    const auto file = bake_and_open(mixed_scene(seed), folder / "scene.rpb", 40 << 10, 8);
    WideBlockMaker maker;
    for (const uint32_t block : {1u, 0u, 1u}) {
        AlignedBytes stored = read_block(*file, block);
        const std::span<const std::byte> made = maker.make(stored.span(), file->scene().block_entries_of(block).roots);
        EXPECT_TRUE(std::ranges::equal(made, wide_form(*file, block))) << "block " << block;
        EXPECT_TRUE(std::ranges::equal(maker.roots(), file->scene().block_entries_of(block).wide_roots));
    }
}

// The goal of the format: 45 bytes a triangle in the memory of a CPU.
TEST(WideBlocks, StaySmall) {
    TemporaryFolder folder;
    const auto bytes = [&](TriangleMesh mesh) {
        const auto file = bake_and_open(scene_of({mesh_shape(std::move(mesh))}), folder / "scene.rpb", 1 << 20);
        return static_cast<double>(file->scene().geometry_bytes(BlockForm::wide)) / static_cast<double>(file->scene().triangles);
    };
    EXPECT_LT(bytes(terrain(200)), 45);
    EXPECT_LT(bytes(icosphere(6)), 45);
}

// A file whose blocks take another form than it says must not be traced with roots that lead elsewhere.
TEST(WideBlocks, OtherRootsThanTheFileSaysAreRefused) {
    TemporaryFolder folder;
    const auto file = bake_and_open(mixed_scene(seed), folder / "scene.rpb", 40 << 10, 8);
    BakedScene scene = file->scene();
    scene.wide_roots[0] ^= 1;
    std::vector<std::byte> bytes(std::max(scene.blocks[0].stored_bytes, scene.blocks[0].wide_bytes));
    AlignedBytes stored = read_block(*file, 0);
    std::ranges::copy(stored.span(), bytes.begin());
    const Status status = transcode_block(scene, 0, BlockForm::wide, bytes);
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.message().find("block 0"), std::string::npos);
}

TEST(WideTop, LeadsToEveryBlockEntry) {
    TemporaryFolder folder;
    const auto file = bake_and_open(mixed_scene(seed), folder / "scene.rpb", 40 << 10, 8);
    const BakedScene& scene = file->scene();
    const auto [bytes, block_entries, object_roots] = make_wide_top(scene.top_grid, {}, scene.top_nodes, scene.block_entries, scene.wide_roots);
    const auto header = at<rp_wide_header>(bytes, 0);
    ASSERT_EQ(header.block, RP_NONE);
    ASSERT_EQ(block_entries.size(), scene.block_entries.size());
    WideReader reader(bytes, RP_NONE, block_entries);
    reader.read(header.root);
    ASSERT_EQ(reader.block_entries_found.size(), block_entries.size());
    std::vector<bool> seen(block_entries.size());
    for (size_t i = 0; i < block_entries.size(); i++) {
        const rp_u32 block_entry = reader.block_entries_found[i];
        EXPECT_FALSE(seen[block_entry]) << block_entry;
        seen[block_entry] = true;
        EXPECT_EQ(reader.block_entry_roots[i], scene.wide_roots[block_entry]);
        EXPECT_EQ(block_entries[block_entry].block, scene.block_entries[block_entry].block);
    }
}

TEST(WideTop, OfAnEmptySceneHasNoRoot) {
    rp_top_grid grid = {};
    grid.root = RP_REF_EXIT;
    const auto top = make_wide_top(grid, {}, {}, {}, {});
    EXPECT_TRUE(top.block_entries.empty());
    EXPECT_EQ(at<rp_wide_header>(top.bytes, 0).root, RP_NONE);
}

// A chain, which is the deepest tree there is, and a balanced one: all leaves are reached once, costs never exceed those of the binary tree.
TEST(Collapse, KeepsEveryLeaf) {
    std::mt19937 random(seed);
    for (int trial = 0; trial < 200; trial++) {
        std::vector<BinaryNode> nodes;
        uint32_t leaves = 0;
        const auto grow = [&](auto&& self, uint32_t depth) -> uint32_t {
            const auto index = static_cast<uint32_t>(nodes.size());
            nodes.emplace_back();
            const auto coordinate = [&] { return static_cast<float>(random() % 1000); };
            nodes[index].box.grow(Float3{coordinate(), coordinate(), coordinate()});
            nodes[index].box.grow(Float3{coordinate(), coordinate(), coordinate()});
            if (depth == 0 || random() % 4 == 0) {
                nodes[index].item = leaves++;
                nodes[index].leaf_cost = 1;
                return index;
            }
            const uint32_t left = self(self, depth - 1), right = self(self, trial % 2 ? 0 : depth - 1);
            nodes[index].left = left;
            nodes[index].right = right;
            nodes[index].box.grow(nodes[left].box);
            nodes[index].box.grow(nodes[right].box);
            return index;
        };
        grow(grow, 1 + trial % 12);
        Collapse collapse;
        collapse.run(nodes);
        std::vector<uint32_t> seen(leaves);
        const auto visit = [&](auto&& self, uint32_t index, bool is_leaf) -> void {
            if (is_leaf) {
                ASSERT_TRUE(nodes[index].is_leaf()) << "only these have a cost as leaves";
                seen[nodes[index].item]++;
                return;
            }
            const WideChildren children = collapse.children(index);
            ASSERT_GE(children.count(), 2u);
            ASSERT_LE(children.count(), uint32_t{RP_WIDE_CHILDREN});
            for (const WideChild& child : children) self(self, child.node, child.leaf);
        };
        visit(visit, 0, collapse.is_leaf(0));
        for (const uint32_t count : seen) ASSERT_EQ(count, 1u) << "trial " << trial;
    }
}

}  // namespace
}  // namespace raypager
