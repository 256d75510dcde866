// Radius and colour codes of points, their Morton order, spacing, culling and filtering.
#include <gtest/gtest.h>

#include <bit>
#include <set>

#include "block/point_code.hpp"
#include "clouds/point_spacing.hpp"
#include "clouds/point_view.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

constexpr uint32_t points_seed = 20260611;

TEST(PointCode, RadiiGrowWithTheirCodes) {
    EXPECT_EQ(point_radius(0), RP_POINT_MIN_RADIUS);
    EXPECT_EQ(point_radius(RP_POINT_LARGEST_CODE), RP_POINT_LARGEST_RADIUS);
    EXPECT_EQ(point_radius(16 << 3), 1.0f);
    for (uint32_t code = 0; code <= RP_POINT_LARGEST_CODE; code++) {
        const float radius = point_radius(code);
        EXPECT_EQ(point_radius_code(radius), code);
        if (code == 0) continue;
        EXPECT_GT(radius, point_radius(code - 1));
        EXPECT_LE(radius, point_radius(code - 1) * 1.125f);
        // What lies between two is rounded up.
        EXPECT_EQ(point_radius_code(std::nextafter(point_radius(code - 1), 1e9f)), code);
        EXPECT_EQ(point_radius_code(std::nextafter(radius, 0.0f)), code);
    }
}

TEST(PointCode, WhatDoesNotFitBecomesTheNearest) {
    EXPECT_EQ(point_radius_code(1e-20f), 0u);
    EXPECT_EQ(point_radius_code(0), 0u);
    EXPECT_EQ(point_radius_code(1e20f), RP_POINT_LARGEST_CODE);
    EXPECT_FALSE(point_radius_fits(1e-5f));
    EXPECT_FALSE(point_radius_fits(60000));
    EXPECT_TRUE(point_radius_fits(RP_POINT_MIN_RADIUS));
    EXPECT_TRUE(point_radius_fits(RP_POINT_LARGEST_RADIUS));
}

TEST(PointCode, ColorsKeepWithinAStepOfTheirLight) {
    EXPECT_EQ(point_color_code(0xffffff), 0xffffffu);
    EXPECT_EQ(point_color_code(0), 0u);
    for (uint32_t c = 0; c < 256; c++) {
        const double srgb = c / 255.0, linear = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
        const uint32_t code = point_color_code(c | (255 - c) << 8);
        // Half a step of the square root: 2 sqrt(x) / 510.
        EXPECT_NEAR(point_reflectance(code)[0], linear, 2 * std::sqrt(linear) / 510 + 1e-5) << c;
        EXPECT_EQ(code >> 16, 0u);
        EXPECT_EQ(point_color_code(c << 16), (code & 255u) << 16);
    }
}

TEST(PointOrder, CellsAreRunsAndLieOnMultiplesOfTheirSize) {
    const auto points = random_points(5000, points_seed);
    const PointOrder order = make_point_order(points);
    ASSERT_EQ(order.size(), points.size());
    EXPECT_EQ(std::set<uint32_t>(order.indices.begin(), order.indices.end()).size(), points.size());
    EXPECT_TRUE(std::is_sorted(order.keys.begin(), order.keys.end()));
    for (const int level : {10, 14, 16, 18}) {
        const double size = order.grid.size(level);
        for (size_t i = 0; i < order.size(); i += 7) {
            const Float3 low = cell_corner(order.grid, order.keys[i], level), p = points[order.indices[i]].position;
            const double corner[3] = {low.x, low.y, low.z}, place[3] = {p.x, p.y, p.z};
            for (int a = 0; a < 3; a++) {
                EXPECT_LE(corner[a], place[a]);
                EXPECT_LT(place[a], corner[a] + size);
                EXPECT_EQ(std::remainder(corner[a], size), 0) << "level " << level;
            }
        }
    }
    size_t next = 0;
    for_each_child(order, 0, order.size(), point_grid_levels, [&](size_t begin, size_t end) {
        EXPECT_EQ(begin, next);
        EXPECT_LT(begin, end);
        next = end;
    });
    EXPECT_EQ(next, order.size());
}

std::vector<CloudPoint> even_sheet(uint32_t n, float spacing) {
    std::vector<CloudPoint> points;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++) points.push_back({{spacing * static_cast<float>(i), spacing * static_cast<float>(j), 0.3f}});
    return points;
}

TEST(PointSpacing, OfAnEvenSheetIsThatOfItsPoints) {
    for (const float step : {0.001f, 0.7f, 300.0f}) {
        const auto points = even_sheet(60, step);
        // In cells of few points most lie at the border; then the third neighbour may be a diagonal away.
        for (const float spacing : estimate_point_spacing(points, make_point_order(points))) {
            EXPECT_GE(spacing, 0.99f * step);
            EXPECT_LE(spacing, 1.42f * step);
        }
    }
}

TEST(PointSpacing, FollowsTheDensityAndNoBalloonsComeOfOutliers) {
    std::vector<CloudPoint> points = even_sheet(50, 0.01f);
    const size_t fine = points.size();
    for (CloudPoint p : even_sheet(50, 0.2f)) {
        p.position.x += 5;
        points.push_back(p);
    }
    const size_t all = points.size();
    points.push_back({{-30, 4, 90}});
    points.push_back({{40, -70, -3}});
    const auto spacing = estimate_point_spacing(points, make_point_order(points));
    for (size_t i = 0; i < all; i++) EXPECT_NEAR(spacing[i] / (i < fine ? 0.01f : 0.2f), 1.2f, 0.25f) << i;
    for (size_t i = all; i < points.size(); i++) EXPECT_LE(spacing[i], 0.3f);
}

TEST(PointSpacing, AClosedSurfaceComesOfStrewnPoints) {
    std::mt19937 random(points_seed);
    std::uniform_real_distribution<float> place(0, 1);
    std::vector<CloudPoint> points;
    for (int i = 0; i < 20000; i++) points.push_back({{place(random), place(random), 0}});
    const auto spacing = estimate_point_spacing(points, make_point_order(points));
    double covered = 0;
    constexpr int tries = 2000;
    for (int i = 0; i < tries; i++) {
        const float x = place(random), y = place(random);
        bool hit = false;
        for (size_t k = 0; k < points.size() && !hit; k++)
            hit = std::hypot(points[k].position.x - x, points[k].position.y - y) <= point_radius_of_spacing * spacing[k];
        covered += hit;
    }
    // The expected share for radius r and density n is 1 - exp(-pi n r^2), 0.9 for the mean third neighbour; the limits are 3 sigma and more.
    EXPECT_GT(covered / tries, 0.86) << "seed " << points_seed;
    EXPECT_LT(covered / tries, 0.97) << "bloated; seed " << points_seed;
}

TEST(PointSpacing, OfACellDoesNotDependOnTheRest) {
    const auto sheet = even_sheet(64, 1.0f / 64);
    std::vector<CloudPoint> more = sheet;
    for (CloudPoint p : even_sheet(64, 1.0f / 32)) {
        p.position.x += 4;
        p.position.z += 8;
        more.push_back(p);
    }
    const auto alone = estimate_point_spacing(sheet, make_point_order(sheet)), among = estimate_point_spacing(more, make_point_order(more));
    for (size_t i = 0; i < alone.size(); i++) ASSERT_EQ(alone[i], among[i]);
}

TEST(PointSpacing, IsMoreThanNothingWhateverComes) {
    EXPECT_TRUE(estimate_point_spacing({}, make_point_order({})).empty());
    const std::vector<CloudPoint> one = {{{1, 2, 3}}}, same(1000, {{1e6f, 2, 3}}), two = {{{0, 0, 0}}, {{0, 0, 5}}};
    EXPECT_EQ(estimate_point_spacing(one, make_point_order(one)), std::vector<float>{1});
    EXPECT_EQ(estimate_point_spacing(same, make_point_order(same)), std::vector<float>(1000, 1));
    EXPECT_EQ(estimate_point_spacing(two, make_point_order(two)), (std::vector<float>{1.25f, 1.25f})) << "few points keep apart";
}

Camera test_camera() { return *make_camera({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 90, 100, 100); }

TEST(PointView, SeesWhatTheMarginAllows) {
    const PointView tight(test_camera(), 100, 100, 0), wide(test_camera(), 100, 100, 0.2);
    EXPECT_TRUE(tight.sees({0, 0, 1}));
    EXPECT_TRUE(tight.sees({9.9f, -9.9f, 10}));
    EXPECT_FALSE(tight.sees({10.1f, 0, 10}));
    EXPECT_FALSE(tight.sees({0, 10.1f, 10}));
    EXPECT_TRUE(wide.sees({10.1f, 0, 10}));
    EXPECT_TRUE(wide.sees({0, -11.9f, 10}));
    EXPECT_FALSE(wide.sees({12.1f, 0, 10}));
    EXPECT_FALSE(wide.sees({0, 0, -1}));
    EXPECT_NEAR(tight.footprint(10), 0.2, 1e-6);
    EXPECT_EQ(tight.distance({1, -1, -1}, 2), 1);
    EXPECT_EQ(tight.distance({-1, -1, -1}, 2), 0);
}

TEST(PointFilter, KeepsAboutOneAPixelAndCoversTheRest) {
    // A sheet far away, 100 points a pixel; and near the eye one with a point every 10 pixels.
    std::vector<CloudPoint> points = even_sheet(200, 0.01f);
    for (CloudPoint& p : points) p = {{p.position.x - 1, p.position.y - 1, 5}, 0.01f, 0x204060};
    const size_t far = points.size();
    for (CloudPoint p : even_sheet(10, 0.1f)) points.push_back({{p.position.x - 0.5f, p.position.y - 0.5f, 0.5f}, 0.02f, 0x00ff00});
    const std::vector<CloudPoint> before = points;
    const PointView view(test_camera(), 100, 100, 0);
    const std::vector<bool> kept = filter_to_pixels(points, make_point_order(points), view);
    // A pixel is 0.1 wide there: cells of 1/16 hold about 39 points.
    const auto left = static_cast<size_t>(std::count(kept.begin(), kept.begin() + static_cast<ptrdiff_t>(far), true));
    EXPECT_LT(left, far / 20);
    EXPECT_GT(left, far / 100);
    for (size_t i = far; i < points.size(); i++) {
        EXPECT_TRUE(kept[i]);
        EXPECT_EQ(points[i].radius, before[i].radius);
    }
    std::vector<CloudPoint> standing;
    for (size_t i = 0; i < far; i++) {
        if (!kept[i]) continue;
        EXPECT_EQ(points[i].color, 0x204060u);
        EXPECT_EQ(points[i].position, before[i].position);
        EXPECT_LE(points[i].radius, 0.06f);  // half the diagonal of a cell of 1/16
        standing.push_back(points[i]);
    }
    for (size_t i = 0; i < far; i += 7) {
        const Float3 p = before[i].position;
        EXPECT_TRUE(std::any_of(standing.begin(), standing.end(), [&](const CloudPoint& s) {
            return std::hypot(s.position.x - p.x, s.position.y - p.y) <= s.radius;
        })) << i;
    }
}

TEST(PointFilter, MixesColors) {
    std::vector<CloudPoint> points = {{{0, 0, 5}, 0.001f, 0x0000ff}, {{0.001f, 0, 5}, 0.002f, 0x00ff00}};
    const PointView view(test_camera(), 100, 100, 0);
    const auto kept = filter_to_pixels(points, make_point_order(points), view);
    ASSERT_EQ(std::count(kept.begin(), kept.end(), true), 1);
    const CloudPoint& left = points[kept[0] ? 0 : 1];
    EXPECT_EQ(left.color, 0x00b4b4u);  // 255 / sqrt(2)
    EXPECT_NEAR(left.radius, 0.002 * std::sqrt(2), 1e-7);
}

}  // namespace
}  // namespace raypager
