// Clouds as shapes: placing, radii, culling and filtering when they are baked; what is counted and what is refused.
#include <gtest/gtest.h>

#include "block/point_code.hpp"
#include "gather/gather.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

std::vector<float> radii(const Scene& scene, const PointOptions& options = {}) {
    std::vector<float> result;
    for (const WorldSphere& sphere : gathered(scene, options).world.spheres) result.push_back(sphere.radius);
    return result;
}

const std::vector<CloudPoint> few = {{{0, 0, 0}, 0.5f, 0x102030}, {{1, 0, 0}, 0.25f, 0xffffff}, {{0, 4, 0}, 1.1f, 0}};

TEST(Clouds, PointsAreNumberedAndColoredInOrder) {
    Scene scene = scene_of({sphere_shape({9, 9, 9}, 1), cloud_shape(few), cloud_shape(few, false), mesh_shape(soup(5, 1))});
    const Gathered all = gathered(scene);
    ASSERT_EQ(all.world.primitives.size(), 12u);
    for (uint32_t i = 0; i < 3; i++) {
        const WorldSphere &point = all.world.sphere(1 + i), &plain = all.world.sphere(4 + i);
        EXPECT_TRUE(point.is_point());
        EXPECT_EQ(point.center, few[i].position);
        EXPECT_EQ(point.point_word >> 8, point_color_code(few[i].color));
        EXPECT_EQ(point.radius, point_radius(point.point_word & 255u));
        EXPECT_GE(point.radius, few[i].radius);
        EXPECT_FALSE(plain.is_point());
        EXPECT_EQ(plain.radius, few[i].radius);
    }
    // The sphere; the coloured cloud; the plain cloud and the mesh share a material and have no flags.
    ASSERT_EQ(all.ranges.size(), 3u);
    EXPECT_EQ(all.ranges[0].flags, 0u);
    EXPECT_EQ(all.ranges[1].flags, RP_RANGE_POINT_COLOR);
    EXPECT_EQ(all.ranges[1].first_primitive, 1u);
    EXPECT_EQ(all.ranges[2].flags, 0u);
    EXPECT_EQ(all.ranges[2].first_primitive, 4u);
}

TEST(Clouds, RadiiComeFromWhereTheOptionsSay) {
    Scene scene = scene_of({cloud_shape(few, false)});
    Shape& cloud = scene.shapes[0];
    EXPECT_EQ(radii(scene), (std::vector<float>{0.5f, 0.25f, 1.1f}));
    cloud.radius_scale = 2;
    EXPECT_EQ(radii(scene), (std::vector<float>{1.0f, 0.5f, 2.2f}));
    EXPECT_EQ(radii(scene, {.radius_scale = 2}), (std::vector<float>{2.0f, 1.0f, 4.4f}));
    cloud.point_radius = 0.75f;
    EXPECT_EQ(radii(scene), (std::vector<float>(3, 0.75f)));
    EXPECT_EQ(radii(scene, {.radius = 0.125f}), (std::vector<float>(3, 0.125f)));
    // The nearest neighbour is 1 away from most, and so few points take a quarter of that.
    const auto spaced = radii(scene, {.radius_from_spacing = true});
    for (const float radius : spaced) EXPECT_NEAR(radius, 2 * 0.9 * 0.25 * 1, 1e-3);
}

TEST(Clouds, ArePlacedByTheirTransform) {
    Scene scene = scene_of({cloud_shape(few, false)});
    scene.shapes[0].to_world = Transform::translate(10, 20, 30) * Transform::rotate(90, 0, 0, 1) * Transform::scale(2, 2, -2);
    const Gathered all = gathered(scene);
    const WorldSphere& sphere = all.world.spheres[1];
    EXPECT_NEAR(sphere.center.x, 10, 1e-5);
    EXPECT_NEAR(sphere.center.y, 22, 1e-5);
    EXPECT_NEAR(sphere.center.z, 30, 1e-5);
    EXPECT_NEAR(sphere.radius, 0.5, 1e-6);
}

TEST(Clouds, WhatTheCameraDoesNotSeeIsLeftOutIfAskedFor) {
    std::vector<CloudPoint> points;
    for (int i = 0; i < 1000; i++) points.push_back({{static_cast<float>(i - 500) * 0.02f, 0, 5}, 0.01f, 0xff});
    Scene scene = scene_of({cloud_shape(points)});
    scene.width = scene.height = 64;
    scene.camera = *make_camera({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 60, 64, 64);
    EXPECT_EQ(gathered(scene).points_culled, 0u);
    const Gathered culled = gathered(scene, {.cull_to_camera = true, .cull_margin = 0});
    // tan 30 degrees * 5 = 2.887 to either side.
    EXPECT_EQ(culled.world.spheres.size(), 289u);
    EXPECT_EQ(culled.points_culled, 711u);
    EXPECT_GT(gathered(scene, {.cull_to_camera = true, .cull_margin = 0.5f}).world.spheres.size(), 430u);
    const Gathered filtered = gathered(scene, {.filter_to_image = true});
    EXPECT_GT(filtered.points_merged, 500u);
    EXPECT_EQ(filtered.points_merged + filtered.world.spheres.size(), 1000u);
}

TEST(Clouds, WhatMakesNoSenseIsCountedOrRefused) {
    std::vector<CloudPoint> points = few;
    points.push_back({{NAN, 0, 0}, 1});
    points.push_back({{0, 0, 9}, 1e-9f});
    Scene scene = scene_of({cloud_shape(points)});
    const Gathered all = gathered(scene);
    EXPECT_EQ(all.issues.not_finite, 1u);
    EXPECT_EQ(all.issues.changed_radius, 1u);
    EXPECT_EQ(all.world.spheres.size(), 4u);
    EXPECT_EQ(all.world.spheres[3].radius, RP_POINT_MIN_RADIUS);
    EXPECT_NE(all.issues.describe().find("radius"), std::string::npos);
    scene.shapes[0].to_world = Transform::scale(1e14, 1e14, 1e14);
    const auto refused = gather(scene, [](double) {});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.status().message().find("cloud: "), 0u) << refused.status().message();
    scene.shapes[0].radius_scale = 0;
    EXPECT_FALSE(validate(scene).ok());
}

TEST(Clouds, FingerprintFollowsPointsAndOptions) {
    Scene scene = scene_of({cloud_shape(few)});
    BakeOptions options;
    std::set<uint64_t> seen = {*bake_fingerprint(scene, options)};
    const auto is_new = [&] { return seen.insert(*bake_fingerprint(scene, options)).second; };
    EXPECT_FALSE(is_new());
    options.points.radius = 1;
    EXPECT_TRUE(is_new());
    options.points.radius_from_spacing = true;
    EXPECT_TRUE(is_new());
    options.points.radius_scale = 3;
    EXPECT_TRUE(is_new());
    options.points.cull_to_camera = true;
    EXPECT_TRUE(is_new());
    options.points.cull_margin = 0.5f;
    EXPECT_TRUE(is_new());
    options.points.filter_to_image = true;
    EXPECT_TRUE(is_new());
    scene.shapes[0].point_radius = 2;
    EXPECT_TRUE(is_new());
    scene.shapes[0].radius_scale = 2;
    EXPECT_TRUE(is_new());
    scene.shapes[0].points = std::make_shared<PointsInMemory>("cloud", random_points(3, 1), true);
    EXPECT_TRUE(is_new());
}

// Format: what a point costs.
TEST(Clouds, TakeAtMost26BytesAPoint) {
    TemporaryFolder folder;
    const auto file = bake_and_open(scene_of({cloud_shape(random_points(100000, 7))}), folder / "cloud.rpb", 256 << 10);
    const double bytes = static_cast<double>(file->scene().stored_bytes()) / 100000;
    EXPECT_LE(bytes, 26);
    EXPECT_GE(bytes, 20);
}

}  // namespace
}  // namespace raypager
