// Order and spacing of clouds against what their definitions say, one point and one cell after another; with any number of threads, and within bounds
// of time whatever comes.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "base/files.hpp"
#include "base/parallel.hpp"
#include "clouds/point_spacing.hpp"
#include "support/sanitizers.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// The definition in point_distance.hpp, of points that are enough for a surface.
float plain_compared_spacing(const std::vector<Float3>& points) {
    std::vector<float> distances;
    for (size_t i = 0; i < points.size(); i++) {
        std::vector<float> of_point;
        for (size_t j = 0; j < points.size(); j++) {
            const float x = points[i].x - points[j].x, y = points[i].y - points[j].y, z = points[i].z - points[j].z;
            if (i != j) of_point.push_back(x * x + y * y + z * z);
        }
        std::sort(of_point.begin(), of_point.end());
        if (of_point[2] > 0) distances.push_back(of_point[2]);
    }
    if (distances.empty()) return 0;
    std::sort(distances.begin(), distances.end());
    return std::sqrt(distances[distances.size() / 2]);
}

// The definition in point_spacing.hpp: cell by cell, from the root down.
class PlainSpacing {
public:
    explicit PlainSpacing(const std::vector<CloudPoint>& points) : points_(points), grid_(grid_of(points)), spacing_(points.size(), 0.0f) {}

    std::vector<float> run() {
        std::vector<uint32_t> all(points_.size());
        for (uint32_t i = 0; i < all.size(); i++) all[i] = i;
        std::stable_sort(all.begin(), all.end(), [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
        float whole = visit(all, point_grid_levels);
        if (whole == 0) whole = compare(all);
        give(all, whole > 0 ? whole : 1);
        return spacing_;
    }

private:
    static PointGrid grid_of(const std::vector<CloudPoint>& points) {
        Box bounds;
        for (const CloudPoint& point : points) bounds.grow(point.position);
        return make_point_grid(bounds);
    }
    uint64_t key(uint32_t i) const { return morton_key(grid_, points_[i].position); }

    float visit(const std::vector<uint32_t>& cell, int level) {
        if (cell.size() < 24) return 0;
        float spacing = 0;
        if (cell.size() > 64 && level > 0) {
            std::map<uint64_t, std::vector<uint32_t>> children;
            for (const uint32_t i : cell) children[key(i) >> 3 * (level - 1)].push_back(i);
            std::vector<std::pair<float, size_t>> told;
            size_t points = 0, below = 0;
            for (const auto& [number, child] : children) {
                const float of_child = visit(child, level - 1);
                if (of_child == 0) continue;
                told.push_back({of_child, child.size()});
                points += child.size();
            }
            std::sort(told.begin(), told.end());
            for (const auto& [of_child, size] : told)
                if (spacing == 0 && 2 * (below += size) >= points) spacing = of_child;
        }
        if (spacing == 0) spacing = compare(cell);
        give(cell, spacing);
        return spacing;
    }

    float compare(const std::vector<uint32_t>& cell) const {
        const size_t step = (cell.size() + most_compared_points - 1) / most_compared_points;
        std::vector<Float3> positions;
        for (size_t i = 0; i < cell.size(); i += step) positions.push_back(points_[cell[i]].position);
        return positions.size() < 24 ? compared_spacing(positions) : plain_compared_spacing(positions);
    }

    void give(const std::vector<uint32_t>& cell, float spacing) {
        for (const uint32_t i : cell)
            if (spacing_[i] == 0) spacing_[i] = spacing;
    }

    const std::vector<CloudPoint>& points_;
    const PointGrid grid_;
    std::vector<float> spacing_;
};

// A surface, a dense clump, lines, strays, and points that lie in one place.
std::vector<CloudPoint> all_kinds(uint32_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> spread(0, 1);
    std::vector<CloudPoint> points = random_points(count, seed);
    for (uint32_t i = 0; i < count; i++) {
        Float3& p = points[i].position;
        switch (random() % 8) {
            case 0:
                p = {3 + 0.01f * spread(random), 0.01f * spread(random), -2 + 0.01f * spread(random)};
                break;
            case 1:
                p = {spread(random), 0.25f, 0.75f};
                break;
            case 2:
                if (random() % 50 == 0) p = {20 * spread(random), 20 * spread(random), 20 * spread(random)};
                break;
            case 3:
                p = {0.5f, -0.5f, 0.5f};
                break;
            default:
                break;
        }
    }
    return points;
}

TEST(PointSpacing, ComparesAsItsDefinitionSays) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-1, 1);
    for (size_t count = min_surface_points; count <= 256; count += 1 + count / 16) {
        for (const float scale : {1e-6f, 1.0f, 3e7f}) {
            std::vector<Float3> points;
            for (size_t i = 0; i < count; i++)
                points.push_back({scale * place(random), scale * place(random), random() % 2 ? 0 : scale * place(random)});
            for (size_t i = 0; i < count; i += 3) points[i] = points[random() % count];
            EXPECT_EQ(compared_spacing(points), plain_compared_spacing(points)) << count << " points";
        }
    }
}

// With many threads and with one, of clouds that are one task and of such that are many.
TEST(PointSpacing, IsWhatItsDefinitionSays) {
    const uint32_t first_seed = std::random_device{}();
    uint32_t seed = first_seed;
    for (const uint32_t count : {1u, 23u, 24u, 65u, 500u, 30'000u, 150'000u}) {
        SCOPED_TRACE(testing::Message() << count << " points, seed " << ++seed);
        const auto points = all_kinds(count, seed);
        const auto expected = PlainSpacing(points).run(), found = estimate_point_spacing(points, make_point_order(points));
        EXPECT_EQ(found, expected);
        const WorkersAtMost one(1);
        EXPECT_EQ(estimate_point_spacing(points, make_point_order(points)), expected);
    }
}

TEST(PointOrder, IsThatOfKeysAndIndices) {
    const uint32_t first_seed = std::random_device{}();
    uint32_t seed = first_seed;
    for (const uint32_t count : {0u, 1u, 1000u, 200'000u}) {
        SCOPED_TRACE(testing::Message() << count << " points, seed " << ++seed);
        const auto points = all_kinds(count, seed);
        const PointOrder order = make_point_order(points);
        std::vector<PointKey> expected;
        for (uint32_t i = 0; i < count; i++) expected.push_back({morton_key(order.grid, points[i].position), i});
        std::sort(expected.begin(), expected.end());
        ASSERT_EQ(order.size(), count);
        for (size_t i = 0; i < count; i++) ASSERT_TRUE(expected[i] == (PointKey{order.keys[i], order.indices[i]})) << i;
    }
}

// What leaves an octree nothing to divide. Comparing all with all would take minutes.
TEST(PointSpacing, TakesNoLongerForPointsInOnePlace) {
    constexpr uint32_t count = 400'000;
#if RAYPAGER_ADDRESS_SANITIZER || RAYPAGER_THREAD_SANITIZER
    constexpr double seconds = 300;  // ten times what it takes on busy cores
#else
    constexpr double seconds = 20;  // a hundred times what it takes
#endif
    const auto start = std::chrono::steady_clock::now();
    std::vector<CloudPoint> same(count, CloudPoint{{1e6f, 2, 3}}), line, two, nearly;
    for (uint32_t i = 0; i < count; i++) {
        const auto x = static_cast<float>(i);
        line.push_back({{x, 2 * x, 0}});
        two.push_back({{i % 2 ? 1e9f : -1e9f, 0, 0}});
        nearly.push_back({{i % 2 ? 1.0f : std::nextafter(1.0f, 2.0f), i % 3 ? 0 : 1e8f, 0}});
    }
    for (const auto* points : {&same, &line, &two, &nearly}) {
        const auto spacing = estimate_point_spacing(*points, make_point_order(*points));
        EXPECT_TRUE(std::ranges::all_of(spacing, [](float s) { return s > 0 && std::isfinite(s); }));
    }
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), seconds);
}

// In memory and over the disk: the bytes of the block file do not depend on threads.
TEST(PointSpacing, BakesTheSameBytesWithAnyNumberOfThreads) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const TemporaryFolder folder;
    const Scene scene = scene_of({cloud_shape(all_kinds(300'000, seed))});
    for (const uint64_t limit : {uint64_t{16} << 20, uint64_t{1} << 30}) {
        BakeOptions options;
        options.block_bytes = 64 << 10;
        options.host_limit = limit;
        options.points.radius_from_spacing = true;
        std::string bytes[2];
        for (const size_t threads : {1u, 64u}) {
            const WorkersAtMost at_most(threads);
            const auto summary = bake(scene, options, folder / "cloud.rpb");
            ASSERT_TRUE(summary.ok()) << summary.status().message();
            EXPECT_EQ(summary->buckets > 0, limit == uint64_t{16} << 20);
            auto text = read_text(folder / "cloud.rpb");
            ASSERT_TRUE(text.ok());
            bytes[threads > 1] = std::move(*text);
        }
        EXPECT_TRUE(bytes[0] == bytes[1]) << "limit " << limit;
    }
}

}  // namespace
}  // namespace raypager
