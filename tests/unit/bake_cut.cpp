// The cut, the grid, and how many bytes come out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <set>

#include "base/parallel.hpp"
#include "block/grid.hpp"
#include "cut/binning.hpp"
#include "cut/cut.hpp"
#include "cut/partition.hpp"
#include "cut/world_cut.hpp"
#include "gather/gather.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

World world_of(const Scene& scene) { return gathered(scene).world; }

PrimitiveRefs refs_of(const World& world) {
    std::vector<uint32_t> all(world.primitives.size());
    std::iota(all.begin(), all.end(), 0);
    PrimitiveRefs refs;
    make_refs(world, all, refs);
    Weigher(world, Weigher::Sharing::by_index).weigh(refs);
    return refs;
}

std::vector<std::set<uint32_t>> ids_of(const std::vector<Part>& parts, const PrimitiveRefs& refs) {
    std::vector<std::set<uint32_t>> result;
    for (const Part& part : parts) {
        auto& ids = result.emplace_back();
        for (size_t i = part.begin; i < part.end; i++) ids.insert(refs[i].id);
    }
    return result;
}

TEST(Cut, PartsFollowEachOtherAndKeepTheLimit) {
    const World world = world_of(mixed_scene(1));
    for (const uint64_t limit : {uint64_t{1}, uint64_t{5000}, uint64_t{100000}, uint64_t{1} << 30}) {
        PrimitiveRefs refs = refs_of(world);
        const auto parts = cut(refs, limit);
        size_t end = 0;
        for (const Part& part : parts) {
            EXPECT_EQ(part.begin, end);
            EXPECT_GT(part.end, part.begin);
            end = part.end;
            const uint64_t weight = weight_of(std::span(refs).subspan(part.begin, part.end - part.begin));
            EXPECT_TRUE(weight <= limit || part.end - part.begin == 1) << weight;
        }
        EXPECT_EQ(end, refs.size());
    }
}

// Of sets that are looked at as a whole.
TEST(Cut, DoesNotDependOnTheOrderOfPrimitives) {
    constexpr uint32_t seed = 4;
    const World world = world_of(mixed_scene(2));
    PrimitiveRefs refs = refs_of(world), shuffled = refs;
    std::mt19937 random(seed);
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    const auto parts = cut(refs, 20000), parts_of_shuffled = cut(shuffled, 20000);
    EXPECT_GT(parts.size(), 10u);
    EXPECT_EQ(ids_of(parts, refs), ids_of(parts_of_shuffled, shuffled));
}

// Large worlds are sorted into regions where the cuts of a sample say, by all threads together.
TEST(Cut, OfAWorldDoesNotDependOnTheNumberOfThreads) {
    const World world = world_of(scene_of({mesh_shape(terrain(400))}));
    const size_t count = world.primitives.size();
    ASSERT_GT(count, size_t{300000});
    constexpr uint64_t limit = 64 << 10;
    for (const auto sharing : {Weigher::Sharing::by_index, Weigher::Sharing::by_value}) {
        SCOPED_TRACE(sharing == Weigher::Sharing::by_index);
        const Weigher weigher(world, sharing);
        const WorldParts by_all = WorldCut(world, weigher).run(limit);
        const WorkersAtMost alone(1);
        const WorldParts by_one = WorldCut(world, weigher).run(limit);
        ASSERT_EQ(by_all.parts.size(), by_one.parts.size());
        size_t end = 0;
        for (size_t i = 0; i < by_all.parts.size(); i++) {
            const Part& part = by_all.parts[i];
            EXPECT_TRUE(part.begin == by_one.parts[i].begin && part.end == by_one.parts[i].end) << i;
            ASSERT_EQ(part.begin, end);
            end = part.end;
            PrimitiveRefs refs;
            make_refs(world, std::span(by_all.order).subspan(part.begin, part.end - part.begin), refs);
            Weigher(world, Weigher::Sharing::by_index).weigh(refs);
            const uint64_t weight = weight_of(refs);
            // Compared by value, triangles at the rim of a region have fewer neighbours there.
            EXPECT_LE(weight, limit);
            // No cut is worse than 1 : 8, so no part is below a ninth; half of that, since the cuts of regions are found on a sample.
            EXPECT_GT(weight, limit / 18);
        }
        EXPECT_EQ(end, count);
        EXPECT_TRUE(by_all.order == by_one.order);
        std::vector<bool> seen(count);
        for (const uint32_t id : by_all.order) seen[id] = true;
        EXPECT_EQ(std::count(seen.begin(), seen.end(), true), static_cast<std::ptrdiff_t>(count));
    }
}

// A sample of 65,536, of weights that differ from their mean of 31 by 24: three standard errors are 0.9 %.
TEST(Cut, OfAWorldEstimatesItsWeight) {
    const World world = world_of(scene_of({mesh_shape(terrain(400)), mesh_shape(soup(40000, 1))}));
    const Weigher weigher(world, Weigher::Sharing::by_index);
    const double weight = static_cast<double>(weight_of(refs_of(world)));
    EXPECT_NEAR(static_cast<double>(WorldCut(world, weigher).weight()), weight, 0.01 * weight);
}

// Whatever plane it is, all on one side of it come first, by all threads together.
TEST(Cut, InTwoIsAtAPlane) {
    PrimitiveRefs halves = refs_of(world_of(scene_of({mesh_shape(terrain(400))})));
    const size_t middle = cut_in_two(halves);
    const Extent left = extent_of(std::span(halves).first(middle)), right = extent_of(std::span(halves).subspan(middle));
    int apart = 0;
    for (int axis = 0; axis < 3; axis++) apart += left.centroids.upper[axis] <= right.centroids.lower[axis];
    EXPECT_GE(apart, 1);
}

TEST(Cut, InTwoOfAllInOnePlaceIsByNumber) {
    PrimitiveRefs refs(200000);
    for (uint32_t i = 0; i < refs.size(); i++) refs[i] = {{{1, 2, 3}, {2, 3, 4}}, (i * 7919u) % 200000u, 20};
    const size_t middle = cut_in_two(refs);
    EXPECT_EQ(middle, 100000u);
    for (size_t i = 0; i < refs.size(); i++) ASSERT_EQ(refs[i].id < middle, i < middle);
}

// A grid leads to the parts; where a ref is must not depend on it. Centres on planes, beyond all samples, and alike.
TEST(Cut, PartitionLeadsWhereItsPlanesSay) {
    constexpr uint32_t seed = 9;
    std::mt19937 random(seed);
    const auto unit = [&] { return std::uniform_real_distribution<float>(-1, 1)(random); };
    const auto steps = [&](float base, float step, uint32_t count) { return base + step * static_cast<float>(random() % count); };
    const std::array<std::function<float(int)>, 8> coordinates = {
        [&](int) { return unit(); },
        [&](int) { return std::round(unit() * 4) / 4; },
        [&](int) { return unit() * 1e12f; },
        [&](int) { return 0.5f; },
        [&](int axis) { return axis == 0   ? unit() * 1e12f
                               : axis == 1 ? unit()
                                           : 0.5f; },  // flat, and far longer than wide
        // Floats coarser than cells, as of a scan in geographic coordinates.
        [&](int) { return steps(4e6f, 0.25f, 40); },
        [&](int axis) { return axis == 1 ? steps(4e6f, 0.25f, 40) : 3.0f; },
        [&](int) { return steps(9e11f, 65536, 30); },
    };
    for (size_t kind = 0; kind < coordinates.size(); kind++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", kind " << kind);
        const auto make = [&](uint32_t id) {
            PrimitiveRef ref = {{}, id, 20};
            for (int a = 0; a < 3; a++) ref.box.lower[a] = ref.box.upper[a] = coordinates[kind](a);
            return ref;
        };
        PrimitiveRefs sample(20000);
        for (uint32_t i = 0; i < sample.size(); i++) sample[i] = make(3 * i);
        const Partition partition(sample, 0, 37);
        EXPECT_EQ(partition.parts(), 37u);
        std::vector<bool> met(partition.parts());
        for (uint32_t i = 0; i < 20000; i++) {
            PrimitiveRef ref = i % 2 ? make(3 * i + 1) : sample[i];
            if (i % 7 == 0) ref.box.lower[i % 3] = ref.box.upper[i % 3] = i % 2 ? 9e11f : -9e11f;
            const uint32_t part = partition.part_of(ref);
            ASSERT_EQ(part, partition.part_from_root(ref.box4(), ref.id));
            met[part] = true;
        }
        EXPECT_EQ(std::count(met.begin(), met.end(), true), 37);
    }
}

TEST(Cut, BlocksAreEven) {
    const World world = world_of(scene_of({mesh_shape(terrain(200))}));
    PrimitiveRefs refs = refs_of(world);
    const auto parts = cut(refs, 64 << 10);
    // No split is worse than 1 : 8, so no block is smaller than a ninth of the limit.
    for (const Part& part : parts) EXPECT_GT((part.end - part.begin) * 24, (64u << 10) / 9);
}

TEST(Grid, HoldsWhateverIsInside) {
    constexpr uint32_t seed = 6;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> exponent(-40, 18), unit(0, 1), sign(-1, 1);
    for (int trial = 0; trial < 20000; trial++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", trial " << trial);
        Box bounds;
        for (int a = 0; a < 3; a++) {
            const double center = sign(random) * std::pow(10, exponent(random)), size = random() % 5 == 0 ? 0 : std::pow(10, exponent(random));
            bounds.lower[a] = static_cast<float>(std::clamp(center - size, -1e18, 1e18));
            bounds.upper[a] = static_cast<float>(std::clamp(center + size, -1e18, 1e18));
        }
        const Grid grid = make_grid(bounds);
        for (int i = 0; i < 20; i++) {
            Box box;
            for (int a = 0; a < 3; a++) {
                const double extent = double(bounds.upper[a]) - bounds.lower[a];
                float p = static_cast<float>(bounds.lower[a] + extent * unit(random)),
                      q = static_cast<float>(bounds.lower[a] + extent * unit(random));
                if (i == 0) p = bounds.lower[a], q = bounds.upper[a];
                if (i % 3 == 1) q = p;
                box.lower[a] = std::clamp(std::min(p, q), bounds.lower[a], bounds.upper[a]);
                box.upper[a] = std::clamp(std::max(p, q), bounds.lower[a], bounds.upper[a]);
            }
            const rp_child child = quantise(grid, box, 7);
            EXPECT_EQ(child.ref, 7u);
            const rp_u32 words[3] = {child.x, child.y, child.z};
            for (int a = 0; a < 3; a++) {
                const Interval decoded = decode_interval(grid, a, words[a]);
                const double cell = grid.cell[a];
                ASSERT_LE(decoded.lower, box.lower[a] - RP_GRID_SLACK * cell);
                ASSERT_GE(decoded.upper, box.upper[a] + RP_GRID_SLACK * cell);
                // Not wasteful either: a step of the grid is half a cell.
                ASSERT_GE(decoded.lower, box.lower[a] - (0.51 + RP_GRID_SLACK) * cell);
                ASSERT_LE(decoded.upper, box.upper[a] + (0.51 + RP_GRID_SLACK) * cell);
            }
        }
    }
}

// What rounding moves along a rod, by as much as its length says, must be within the slack of its thin axes.
TEST(Grid, OfARodHasSlackForItsLength) {
    const Box rod = {{-12, 7, -16}, {12, 7.04f, -15.87f}};
    const Grid grid = make_grid(rod);
    for (int a = 0; a < 3; a++) EXPECT_GE(RP_GRID_SLACK * double(grid.cell[a]), 0x1p-23 * 24) << "axis " << a;
}

TEST(Grid, ValuesAreWhatTheKernelsDecode) {
    for (uint32_t q = 0; q < 65536; q++) ASSERT_EQ(RP_GRID_VALUE(q), double(std::bit_cast<float>(0x47000000u | q << 7)));
}

double bytes_a_primitive(const Scene& scene, uint64_t block_bytes) {
    TemporaryFolder folder;
    const auto file = bake_and_open(scene, folder / "scene.rpb", block_bytes);
    return static_cast<double>(file->scene().stored_bytes()) / static_cast<double>(file->scene().triangles + file->scene().spheres);
}

// Bytes a triangle decide everything out of core.
TEST(BlockSizes, StaySmall) {
    EXPECT_LT(bytes_a_primitive(scene_of({mesh_shape(terrain(200))}), 1 << 20), 22);
    EXPECT_LT(bytes_a_primitive(scene_of({mesh_shape(icosphere(6))}), 1 << 20), 22);
    EXPECT_LT(bytes_a_primitive(scene_of({mesh_shape(terrain(200))}), 32 << 10), 23.5);
    EXPECT_LT(bytes_a_primitive(scene_of({mesh_shape(terrain(200, true))}), 1 << 20), 24.5);  // 4 bytes a vertex more
    EXPECT_LT(bytes_a_primitive(scene_of(random_spheres(5000, 1)), 1 << 20), 32);
    // A list of triangles, each with vertices of its own, is as small as the mesh it was made from.
    const TriangleMesh mesh = terrain(200);
    TriangleMesh list;
    for (const Triangle& t : mesh.triangles) {
        const auto first = static_cast<uint32_t>(list.positions.size());
        for (const uint32_t v : t) list.positions.push_back(mesh.positions[v]);
        list.triangles.push_back({first, first + 1, first + 2});
    }
    EXPECT_LT(bytes_a_primitive(scene_of({mesh_shape(list)}), 1 << 20), 22);
}

// Estimates that are too low cost a second build, such that are too high make blocks small. In how many bits ids are coded follows from their order,
// of which the cut knows nothing: they are taken for whole, a fifth of the bytes.
TEST(BlockSizes, AreEstimatedWell) {
    const struct {
        const char* name;
        Scene scene;
    } cases[] = {{"terrain", scene_of({mesh_shape(terrain(200))})},
                 {"terrain with normals", scene_of({mesh_shape(terrain(200, true))})},
                 {"icosphere", scene_of({mesh_shape(icosphere(6))})},
                 {"soup", scene_of({mesh_shape(soup(20000, 1))})},
                 {"spheres", scene_of(random_spheres(5000, 1))}};
    for (const auto& c : cases) {
        const World world = world_of(c.scene);
        const double ratio =
            static_cast<double>(weight_of(refs_of(world))) / static_cast<double>(world.primitives.size()) / bytes_a_primitive(c.scene, 1 << 20);
        EXPECT_GT(ratio, 1.0) << c.name;
        EXPECT_LT(ratio, 1.3) << c.name;
    }
}

}  // namespace
}  // namespace raypager
