// What goes into a bake comes out of the block file, exactly once, and every promise of abi/block.h holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "base/files.hpp"
#include "block/block_coding.hpp"
#include "block/grid.hpp"
#include "block/wide_block.hpp"
#include "gather/gather.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// The triangle's vertices rotated so that the least one comes first: orientation is kept.
std::array<Float3, 3> canonical(std::array<Float3, 3> t) {
    const auto less = [](const Float3& a, const Float3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
    std::rotate(t.begin(), std::min_element(t.begin(), t.end(), less), t.end());
    return t;
}

struct Case {
    const char* name;
    std::function<Scene()> scene;
    uint64_t block_bytes;
    uint32_t block_entries;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

constexpr uint32_t bake_seed = 20240611;

class Bake : public testing::TestWithParam<Case> {
protected:
    void SetUp() override {
        scene_ = GetParam().scene();
        auto gathered = gather(scene_, [](double) {});
        ASSERT_TRUE(gathered.ok()) << gathered.status().message();
        gathered_ = std::move(*gathered);
        file_ = bake_and_open(scene_, folder_ / "scene.rpb", GetParam().block_bytes, GetParam().block_entries);
    }

    // Block entries of a block, in order.
    std::vector<rp_block_entry> block_entries_of(uint32_t block) const {
        std::vector<rp_block_entry> result;
        for (const rp_block_entry& block_entry : file_->scene().block_entries)
            if (block_entry.block == block) result.push_back(block_entry);
        return result;
    }

    TemporaryFolder folder_;
    Scene scene_;
    Gathered gathered_;
    std::shared_ptr<const BlockFile> file_;
};

TEST_P(Bake, EveryPrimitiveOnceAndExactly) {
    const World& world = gathered_.world;
    std::vector<uint32_t> seen(world.primitives.size());
    for (uint32_t block = 0; block < file_->scene().blocks.size(); block++) {
        AlignedBytes bytes = read_block(*file_, block);
        const BlockView view(bytes.span());
        for (const rp_block_entry& block_entry : block_entries_of(block)) {
            const DecodedLeaf found = decode_subtree(view, block_entry.root);
            for (const DecodedTriangle& t : found.triangles) {
                ASSERT_LT(t.id, seen.size());
                seen[t.id]++;
                const Triangle& expected = world.primitives[t.id];
                ASSERT_FALSE(world.is_sphere(t.id));
                ASSERT_EQ(canonical({t.vertices[0], t.vertices[1], t.vertices[2]}),
                          canonical({world.positions[expected[0]], world.positions[expected[1]], world.positions[expected[2]]}));
                for (int i = 0; i < 3; i++) {
                    bool matches = false;
                    for (const uint32_t v : expected)
                        matches |= world.positions[v] == t.vertices[i] && world.normal(v) == t.normals[i] && world.color(v) == t.colors[i] &&
                                   world.uv(v) == t.uvs[i];
                    ASSERT_TRUE(matches) << "attributes of triangle " << t.id;
                }
            }
            for (const DecodedSphere& s : found.spheres) {
                ASSERT_LT(s.id, seen.size());
                seen[s.id]++;
                ASSERT_TRUE(world.is_sphere(s.id));
                ASSERT_EQ(world.sphere(s.id).center, s.center);
                ASSERT_EQ(world.sphere(s.id).radius, s.radius);
                ASSERT_EQ(world.sphere(s.id).point_word, s.point_word);
            }
        }
    }
    for (size_t i = 0; i < seen.size(); i++) ASSERT_EQ(seen[i], 1u) << "primitive " << i;
}

// Vertices move no further than was asked for, all that lie in one place to the same one, and come out of the file where they moved to.
TEST(BakeOfFewBytes, MovesEveryVertexALittleAndOpensNoCracks) {
    constexpr float error = 2e-4f;
    Scene scene = scene_of({mesh_shape(terrain(100, true)), mesh_shape(icosphere(4)), mesh_shape(terrain(100))});
    scene.shapes[1].to_world = Transform::translate(0.3, 0.4, 1e3) * Transform::rotate(30, 1, 2, 3);
    scene.shapes[2].to_world = Transform::translate(-1, 0, 0);  // shares an edge with the first
    const float cell = position_cell(error);
    const auto exact = gather(scene, [](double) {});
    const auto moved = gather(
        scene, GatherLimits(), [](const char*, double) {}, {}, cell);
    ASSERT_TRUE(exact.ok() && moved.ok());
    const World &from = exact->world, &to = moved->world;
    ASSERT_EQ(from.primitives.size(), to.primitives.size());
    std::map<std::array<float, 3>, Float3> places;
    double furthest = 0;
    for (size_t i = 0; i < from.primitives.size(); i++) {
        for (int k = 0; k < 3; k++) {
            const Float3 &a = from.positions[from.primitives[i][k]], &b = to.positions[to.primitives[i][k]];
            for (const auto coordinate : {&Float3::x, &Float3::y, &Float3::z}) {
                const double by = std::abs(double(a.*coordinate) - b.*coordinate);
                furthest = std::max(furthest, by);
                // Where floats are coarser than the grid, rounding has its part.
                ASSERT_LE(by, cell / 2 + std::abs(a.*coordinate) * 0x1p-24);
                ASSERT_EQ(std::remainder(b.*coordinate, cell), 0) << "not on the grid";
            }
            const auto [known, is_new] = places.try_emplace({a.x, a.y, a.z}, b);
            ASSERT_EQ(known->second, b) << "a crack";
        }
    }
    EXPECT_GT(furthest, error / 4) << "nothing moved";

    const TemporaryFolder folder;
    const auto file = bake_and_open(scene, folder / "scene.rpb", 64 << 10, 64, error);
    EXPECT_EQ(file->scene().position_cell, cell);
    uint64_t found = 0;
    for (uint32_t block = 0; block < file->scene().blocks.size(); block++) {
        AlignedBytes bytes = read_block(*file, block);
        ASSERT_TRUE(file->check_block(block, bytes.span()).ok());
        const BlockView view(bytes.span());
        EXPECT_NE(RP_POSITION_STRIDE(view.header.flags), 0u);
        EXPECT_NE(view.header.flags & RP_IDS_CODED, 0u);
        for (const rp_block_entry& block_entry : file->scene().block_entries) {
            if (block_entry.block != block) continue;
            for (const DecodedTriangle& t : decode_subtree(view, block_entry.root).triangles) {
                const Triangle& expected = to.primitives[t.id];
                ASSERT_EQ(canonical({t.vertices[0], t.vertices[1], t.vertices[2]}),
                          canonical({to.positions[expected[0]], to.positions[expected[1]], to.positions[expected[2]]}));
                found++;
            }
        }
    }
    EXPECT_EQ(found, to.primitives.size());
}

TEST(BakeOfFewBytes, TakesSixteenBytesATriangle) {
    const TemporaryFolder folder;
    const Scene scene = scene_of({mesh_shape(terrain(200))});
    const auto bytes = [&](float error) {
        const auto file = bake_and_open(scene, folder / "scene.rpb", 128 << 10, 64, error);
        return static_cast<double>(file->scene().stored_bytes()) / static_cast<double>(file->scene().triangles);
    };
    EXPECT_LE(bytes(1e-5f), 16);  // of a terrain of size 1
    EXPECT_GT(bytes(0), 17);
    EXPECT_LE(bytes(0), 22);
}

// The bounds of what lies beneath ref; checks that every box on the way holds its subtree with the promised slack.
Box checked_bounds(const BlockView& view, const Grid& grid, rp_u32 ref, int depth) {
    Box bounds;
    EXPECT_LE(depth, RP_BLOCK_MAX_DEPTH);
    if (ref & RP_REF_LEAF) {
        DecodedLeaf leaf;
        decode_leaf(view, ref, leaf);
        for (const DecodedTriangle& t : leaf.triangles)
            for (const Float3& v : t.vertices) bounds.grow(v);
        for (const DecodedSphere& s : leaf.spheres) bounds.grow(sphere_bounds({s.center, s.radius, s.point_word}));
        return bounds;
    }
    for (const rp_child& child : view.nodes[ref].child) {
        const Box inside = checked_bounds(view, grid, child.ref, depth + 1);
        const rp_u32 words[3] = {child.x, child.y, child.z};
        for (int a = 0; a < 3; a++) {
            const Interval box = decode_interval(grid, a, words[a]);
            EXPECT_LE(box.lower, inside.lower[a] - RP_GRID_SLACK * grid.cell[a]);
            EXPECT_GE(box.upper, inside.upper[a] + RP_GRID_SLACK * grid.cell[a]);
        }
        bounds.grow(inside);
    }
    return bounds;
}

TEST_P(Bake, BoxesHoldWhatIsBeneath) {
    for (uint32_t block = 0; block < file_->scene().blocks.size(); block++) {
        AlignedBytes bytes = read_block(*file_, block);
        const BlockView view(bytes.span());
        Grid grid;
        std::copy_n(view.header.origin, 3, grid.origin);
        std::copy_n(view.header.cell, 3, grid.cell);
        Box bounds;
        const auto block_entries = block_entries_of(block);
        for (const rp_block_entry& block_entry : block_entries) bounds.grow(checked_bounds(view, grid, block_entry.root, 0));
        // What is above the block entries holds the same.
        const Box whole = block_entries.size() > 1 ? checked_bounds(view, grid, 0, 0) : bounds;
        for (int a = 0; a < 3; a++) {
            EXPECT_EQ(bounds.lower[a], file_->scene().blocks[block].lower[a]);
            EXPECT_EQ(bounds.upper[a], file_->scene().blocks[block].upper[a]);
            EXPECT_EQ(whole.lower[a], bounds.lower[a]);
            EXPECT_EQ(whole.upper[a], bounds.upper[a]);
        }
    }
}

// A bake reckons it beforehand; a block whose form for CPUs differed from that could not be loaded.
TEST_P(Bake, WideFormsAreAsLargeAsTheFileSays) {
    WideBlockMaker maker;
    for (uint32_t block = 0; block < file_->scene().blocks.size(); block++) {
        AlignedBytes bytes = read_block(*file_, block);
        const BlockEntryRoots block_entries = file_->scene().block_entries_of(block);
        EXPECT_EQ(maker.make(bytes.span(), block_entries.roots).size(), file_->scene().blocks[block].wide_bytes);
        EXPECT_TRUE(std::ranges::equal(maker.roots(), block_entries.wide_roots));
    }
}

// A ray that enters a block as a whole meets what lies beneath its block entries, once.
TEST_P(Bake, TheRootOfABlockLeadsToAllOfIt) {
    uint32_t with_block_entries = 0;
    for (uint32_t block = 0; block < file_->scene().blocks.size(); block++) {
        const auto block_entries = block_entries_of(block);
        if (block_entries.size() == 1) continue;
        with_block_entries++;
        AlignedBytes bytes = read_block(*file_, block);
        const DecodedLeaf all = decode_subtree(BlockView(bytes.span()), 0);
        std::set<uint32_t> ids;
        for (const DecodedTriangle& t : all.triangles) ids.insert(t.id);
        for (const DecodedSphere& s : all.spheres) ids.insert(s.id);
        const BlockRecord& record = file_->scene().blocks[block];
        EXPECT_EQ(all.triangles.size(), record.triangles);
        EXPECT_EQ(all.spheres.size(), record.spheres);
        EXPECT_EQ(ids.size(), uint64_t{record.triangles} + record.spheres);
    }
    EXPECT_TRUE(with_block_entries > 0 || GetParam().block_entries == 1 || file_->scene().blocks.size() < 2);
}

// Else rays would have to enter block entry by block entry what is resident.
TEST_P(Bake, BlockEntriesOfABlockAreASubtreeOfTheTopTree) {
    const BakedScene& scene = file_->scene();
    int deepest = 0;
    for (size_t first = 0, end = 0; first < scene.block_entries.size(); first = end) {
        uint64_t common = scene.block_entry_paths[first];
        for (end = first; end < scene.block_entries.size() && scene.block_entries[end].block == scene.block_entries[first].block; end++) {
            uint64_t path = scene.block_entry_paths[end];
            while (path != common) (path > common ? path : common) >>= 1;
        }
        // Block entries at these depths below what they have in common leave no room for others.
        double taken = 0;
        for (size_t i = first; i < end; i++) {
            const int depth = static_cast<int>(std::bit_width(scene.block_entry_paths[i])) - static_cast<int>(std::bit_width(common));
            EXPECT_LE(depth, RP_UPPER_TREE_MAX_DEPTH);
            deepest = std::max(deepest, depth);
            taken += std::ldexp(1.0, -depth);
        }
        EXPECT_EQ(taken, 1.0) << "block " << scene.block_entries[first].block;
    }
    const bool deep = std::string_view(GetParam().name) == "nested_clusters";
    EXPECT_TRUE(!deep || deepest == RP_UPPER_TREE_MAX_DEPTH) << "the bound is not tested";
}

TEST_P(Bake, BlocksKeepTheirLimitAndHoldTogether) {
    uint64_t bytes_in_all = 0;
    for (uint32_t block = 0; block < file_->scene().blocks.size(); block++) {
        AlignedBytes bytes = read_block(*file_, block);
        const Status status = file_->check_block(block, bytes.span());
        EXPECT_TRUE(status.ok()) << status.message();
        const BlockRecord& record = file_->scene().blocks[block];
        EXPECT_LE(record.stored_bytes, GetParam().block_bytes);
        EXPECT_EQ(record.stored_bytes % RP_BLOCK_ALIGNMENT, 0u);
        EXPECT_EQ(record.wide_bytes % RP_BLOCK_ALIGNMENT, 0u);
        EXPECT_LE(block_entries_of(block).size(), GetParam().block_entries);
        bytes_in_all += record.stored_bytes;
    }
    EXPECT_EQ(bytes_in_all, file_->scene().stored_bytes());
}

// Walks from the root by each block entry's path; boxes on the way must hold the block entry's geometry.
TEST_P(Bake, PathsLeadToTheirBlockEntries) {
    const BakedScene& scene = file_->scene();
    Grid grid;
    std::copy_n(scene.top_grid.origin, 3, grid.origin);
    std::copy_n(scene.top_grid.cell, 3, grid.cell);
    std::set<uint64_t> paths;
    AlignedBytes bytes;
    uint32_t loaded = RP_NONE;
    for (uint32_t i = 0; i < scene.block_entries.size(); i++) {
        const uint64_t path = scene.block_entry_paths[i];
        EXPECT_TRUE(paths.insert(path).second);
        if (scene.block_entries[i].block != loaded) bytes = read_block(*file_, loaded = scene.block_entries[i].block);
        const DecodedLeaf beneath = decode_subtree(BlockView(bytes.span()), scene.block_entries[i].root);
        Box bounds;
        for (const DecodedTriangle& t : beneath.triangles)
            for (const Float3& v : t.vertices) bounds.grow(v);
        for (const DecodedSphere& s : beneath.spheres) bounds.grow(sphere_bounds({s.center, s.radius, s.point_word}));
        rp_u32 ref = scene.top_grid.root;
        const int levels = static_cast<int>(std::bit_width(path)) - 1;
        ASSERT_LE(levels, RP_TOP_MAX_DEPTH);
        for (int level = levels - 1; level >= 0; level--) {
            ASSERT_LT(ref, scene.top_nodes.size());
            const rp_child& child = scene.top_nodes[ref].child[path >> level & 1];
            const rp_u32 words[3] = {child.x, child.y, child.z};
            for (int a = 0; a < 3; a++) {
                const Interval box = decode_interval(grid, a, words[a]);
                EXPECT_LE(box.lower, bounds.lower[a] - RP_GRID_SLACK * grid.cell[a]);
                EXPECT_GE(box.upper, bounds.upper[a] + RP_GRID_SLACK * grid.cell[a]);
            }
            ref = child.ref;
        }
        EXPECT_EQ(ref, RP_REF_BLOCK_ENTRY | i);
    }
}

TEST_P(Bake, TwiceIsTheSame) {
    const auto again = bake_and_open(scene_, folder_ / "again.rpb", GetParam().block_bytes, GetParam().block_entries);
    const auto first = read_text(folder_ / "scene.rpb"), second = read_text(folder_ / "again.rpb");
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_TRUE(*first == *second);
    EXPECT_EQ(file_->scene().identity(), again->scene().identity());
}

Scene far_away() {
    // Vertices next to each other far from the origin, on a flat sheet: the grid's worst case.
    TriangleMesh mesh = terrain(40);
    for (Float3& p : mesh.positions) p = {1e6f + p.x * 30, 5000, -3e7f + p.z * 400};
    return scene_of({mesh_shape(std::move(mesh))});
}

// Triangles that differ in size by ten orders of magnitude, at one place: no balanced tree comes out of the heuristic.
Scene nested() {
    TriangleMesh mesh;
    for (uint32_t i = 0; i < 3000; i++) {
        const float s = std::pow(10.0f, -10.0f * float(i) / 3000);
        mesh.positions.insert(mesh.positions.end(), {{s, 0, 0}, {0, s, 0}, {0, 0, s}});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return scene_of({mesh_shape(std::move(mesh))});
}

// Clusters, each far smaller than the one before: the tree takes off one at a time.
Scene nested_clusters() {
    TriangleMesh mesh;
    float scale = 1;
    for (uint32_t cluster = 0; cluster < 25; cluster++, scale *= 0.4f) {
        TriangleMesh one = soup(100, bake_seed + cluster, 0.02f);
        for (Float3& p : one.positions) mesh.positions.push_back({scale * (1 + 0.1f * p.x), scale * (1 + 0.1f * p.y), scale * (1 + 0.1f * p.z)});
        for (const Triangle& t : one.triangles) mesh.triangles.push_back({t[0] + 300 * cluster, t[1] + 300 * cluster, t[2] + 300 * cluster});
    }
    return scene_of({mesh_shape(std::move(mesh))});
}

// All in one place: no split by centres exists.
Scene same_triangle() {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(5000, {0, 1, 2});
    return scene_of({mesh_shape(std::move(mesh))});
}

// Far from the origin small triangles lose their area. What is left keeps its order, however much of the mesh it is.
TEST(Gather, KeepsWhatHasAreaWhereItIsPlaced) {
    for (const uint32_t one_in : {2u, 20u, 1000000u}) {
        SCOPED_TRACE(one_in);
        std::mt19937 random(one_in);
        constexpr double away = 1e6;
        TriangleMesh mesh;
        std::vector<std::array<Float3, 3>> expected;
        for (uint32_t i = 0; i < 200000; i++) {
            const bool small = random() % one_in == 0;
            const auto x = static_cast<float>(i % 1000), z = static_cast<float>(i / 1000), size = small ? 0.001f : 0.5f;
            const std::array<Float3, 3> corners = {Float3{x, 0, z}, Float3{x + size, 0, z}, Float3{x, 0, z + size}};
            for (uint32_t k = 0; k < 3; k++) mesh.positions.push_back(corners[k]);
            mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
            if (small) continue;
            const auto placed = [&](const Float3& p) { return Float3{static_cast<float>(p.x + away), p.y, p.z}; };
            expected.push_back({placed(corners[0]), placed(corners[1]), placed(corners[2])});
        }
        Shape shape = mesh_shape(std::move(mesh));
        shape.to_world = Transform::translate(away, 0, 0);
        const auto gathered = gather(scene_of({shape, mesh_shape(soup(10, 1))}), [](double) {});
        ASSERT_TRUE(gathered.ok()) << gathered.status().message();
        EXPECT_EQ(gathered->issues.degenerate, 200000 - expected.size());
        const World& world = gathered->world;
        ASSERT_EQ(world.primitives.size(), expected.size() + 10);
        for (size_t i = 0; i < expected.size(); i++)
            for (size_t k = 0; k < 3; k++) ASSERT_EQ(world.positions[world.primitives[i][k]], expected[i][k]) << i;
    }
}

// A landscape and its mirror image, which meet at 0 and -0.
Scene mirrored() {
    TriangleMesh right = terrain(60, true), left = right;
    for (Float3& p : left.positions) p.x = -p.x;
    return scene_of({mesh_shape(right), mesh_shape(left)});
}

INSTANTIATE_TEST_SUITE_P(Blocks, Bake,
                         testing::Values(Case{"empty", [] { return scene_of({}); }, 1 << 20, 64},
                                         Case{"one_triangle", [] { return scene_of({mesh_shape(soup(1, bake_seed))}); }, 1 << 20, 64},
                                         Case{"one_sphere",
                                              [] {
                                                  return scene_of({sphere_shape({1, 2, 3}, 0.5f)});
                                              },
                                              1 << 20, 64},
                                         Case{"soup", [] { return scene_of({mesh_shape(soup(20000, bake_seed))}); }, 16 << 10, 64},
                                         Case{"terrain", [] { return scene_of({mesh_shape(terrain(150))}); }, 64 << 10, 64},
                                         Case{"terrain_small_blocks", [] { return scene_of({mesh_shape(terrain(100, true))}); }, 16 << 10, 8},
                                         Case{"zeros_of_both_signs", mirrored, 16 << 10, 64},
                                         Case{"icosphere", [] { return scene_of({mesh_shape(icosphere(6))}); }, 1 << 20, 64},
                                         Case{"spheres", [] { return scene_of(random_spheres(5000, bake_seed)); }, 16 << 10, 1},
                                         Case{"cloud", [] { return scene_of({cloud_shape(random_points(20000, bake_seed))}); }, 16 << 10, 64},
                                         Case{"cloud_without_color", [] { return scene_of({cloud_shape(random_points(3000, bake_seed), false)}); },
                                              16 << 10, 8},
                                         Case{"one_place",
                                              [] {
                                                  return scene_of({cloud_shape(std::vector<CloudPoint>(3000, {{1, 2, 3}, 0.01f}))});
                                              },
                                              16 << 10, 64},
                                         Case{"mixed", [] { return mixed_scene(bake_seed); }, 100 << 10, 64},
                                         Case{"far_away", far_away, 16 << 10, 64}, Case{"nested", nested, 64 << 10, 64},
                                         Case{"nested_clusters", nested_clusters, 256 << 10, 64}, Case{"same_triangle", same_triangle, 64 << 10, 64}),
                         [](const testing::TestParamInfo<Case>& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace raypager
