// Placing shapes in the world, lights and their probabilities, material ranges.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gather/gather.hpp"
#include "gather/lights.hpp"
#include "scene/octahedral.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

TriangleMesh one_triangle() {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}

Float3 normal_of(const World& world, uint32_t primitive) {
    const Triangle& t = world.primitives[primitive];
    const Float3 a = world.positions[t[0]], b = world.positions[t[1]], c = world.positions[t[2]];
    const Float3 u = {b.x - a.x, b.y - a.y, b.z - a.z}, v = {c.x - a.x, c.y - a.y, c.z - a.z};
    return {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

TEST(Gather, OrientationFollowsPbrt) {
    // The transform's image of the normal side, flipped by reverse_orientation exclusive-or a change of handedness.
    for (const bool reverse : {false, true}) {
        for (const bool mirrored : {false, true}) {
            Shape shape = mesh_shape(one_triangle());
            shape.reverse_orientation = reverse;
            if (mirrored) shape.to_world = Transform::scale(-1, 1, 1);
            const World world = gathered(scene_of({shape})).world;
            // Mirroring in x alone turns cross(e1, e2) to -z; the flip that comes with it turns it back.
            EXPECT_EQ(normal_of(world, 0).z, reverse ? -1 : 1) << reverse << mirrored;
        }
    }
}

TEST(Gather, PositionsAreRoundedOnce) {
    Shape shape = mesh_shape(one_triangle());
    shape.to_world = Transform::translate(0.1, 0.2, 0.3) * Transform::scale(1.0 / 3, 1, 1);
    const World world = gathered(scene_of({shape})).world;
    EXPECT_EQ(world.positions[1], (Float3{static_cast<float>(0.1 + 1.0 / 3), 0.2f, 0.3f}));
}

TEST(Gather, NormalsGoWithTheInverseTranspose) {
    TriangleMesh mesh = one_triangle();
    mesh.normals.assign(3, {1, 1, 0});
    Shape shape = mesh_shape(mesh);
    shape.to_world = Transform::scale(2, 1, 1);
    const World world = gathered(scene_of({mesh_shape(one_triangle()), shape})).world;
    EXPECT_EQ(world.normal(0), RP_NONE);
    const Float3 n = decode_octahedral(world.normal(3));
    // A code's step is 1 / 32767; the angle between neighbouring codes is at most twice that.
    EXPECT_NEAR(n.x, 0.5 / std::hypot(0.5, 1), 1e-4);
    EXPECT_NEAR(n.y, 1 / std::hypot(0.5, 1), 1e-4);
    EXPECT_NEAR(n.z, 0, 1e-4);
}

TEST(Gather, DropsWhatNoRayCanHit) {
    TriangleMesh mesh = one_triangle();
    mesh.positions.push_back({1e-30f, 1, 0});
    mesh.positions.push_back({2e-30f, 1, 0});
    mesh.triangles.push_back({2, 3, 4});
    Shape shape = mesh_shape(mesh);
    shape.to_world = Transform::translate(1, 0, 0);  // there, the second one collapses
    const Gathered result = gathered(scene_of({shape}));
    EXPECT_EQ(result.world.primitives.size(), 1u);
    EXPECT_EQ(result.issues.degenerate, 1u);
}

TEST(Gather, RefusesWhatFloatsCannotHold) {
    Shape shape = mesh_shape(one_triangle(), "far.ply");
    shape.to_world = Transform::scale(1e30, 1, 1);
    const auto result = gather(scene_of({shape}), [](double) {});
    ASSERT_FALSE(result.ok());
    EXPECT_NE(result.status().message().find("far.ply"), std::string::npos);
    Shape ellipsoid = sphere_shape({0, 0, 0}, 1);
    ellipsoid.to_world = Transform::scale(1, 2, 1);
    EXPECT_FALSE(gather(scene_of({ellipsoid}), [](double) {}).ok());
}

Scene scene_with_lights() {
    Scene scene =
        scene_of({mesh_shape(terrain(2)), mesh_shape(terrain(3)), mesh_shape(icosphere(0)), sphere_shape({5, 5, 5}, 2), mesh_shape(one_triangle())});
    scene.materials.push_back(gray());
    scene.area_lights = {{{1, 2, 3}, false}, {{4, 4, 4}, true}, {{0, 0, 0}, false}};
    scene.shapes[1].area_light = 2;  // black: no light
    scene.shapes[2].area_light = 0;
    scene.shapes[3].area_light = 1;
    scene.shapes[4].material = 1;
    rp_light point = {};
    point.kind = RP_LIGHT_POINT;
    point.radiance[1] = 10;
    rp_light dark = point;
    dark.radiance[1] = 0;
    scene.lights = {point, dark};
    return scene;
}

TEST(Lights, EmissivePrimitivesInOrderThenTheOthers) {
    const Gathered result = gathered(scene_with_lights());
    ASSERT_EQ(result.lights.size(), 20u + 1 + 2);
    ASSERT_EQ(result.ranges.size(), 4u);  // the first two shapes share one
    EXPECT_EQ(result.ranges[0].first_light, RP_NONE);
    EXPECT_EQ(result.ranges[1].first_primitive, 8u + 18);
    EXPECT_EQ(result.ranges[1].first_light, 0u);
    EXPECT_EQ(result.ranges[2].first_light, 20u);
    EXPECT_EQ(result.ranges[3].first_light, RP_NONE);
    EXPECT_EQ(result.ranges[3].material, 1u);
    for (uint32_t i = 0; i < 20; i++) {
        const rp_light& light = result.lights[i];
        const uint32_t primitive = result.ranges[1].first_primitive + i;
        EXPECT_EQ(light.kind, RP_LIGHT_TRIANGLE);
        EXPECT_EQ(light.flags, 0u);
        const Float3 p = result.world.positions[result.world.primitives[primitive][0]];
        EXPECT_EQ((Float3{light.p[0], light.p[1], light.p[2]}), p);
        const Float3 n = normal_of(result.world, primitive);
        EXPECT_NEAR(light.area, 0.5 * std::hypot(n.x, n.y, n.z), 1e-6);
        // It shines where the triangle's normal points to: outwards.
        const double side = (double(light.e1[1]) * light.e2[2] - double(light.e1[2]) * light.e2[1]) * p.x +
                            (double(light.e1[2]) * light.e2[0] - double(light.e1[0]) * light.e2[2]) * p.y +
                            (double(light.e1[0]) * light.e2[1] - double(light.e1[1]) * light.e2[0]) * p.z;
        EXPECT_GT(side, 0);
    }
    const rp_light& sphere = result.lights[20];
    EXPECT_EQ(sphere.kind, RP_LIGHT_SPHERE);
    EXPECT_EQ(sphere.flags, RP_LIGHT_TWO_SIDED);
    EXPECT_EQ(sphere.e1[0], 2.0f);
    EXPECT_NEAR(sphere.area, 4 * std::numbers::pi * 4, 1e-4);
}

// They are no primitives, and stand behind those that are.
TEST(Lights, UnseenShapesAreLightsAlone) {
    Scene scene = scene_with_lights();
    scene.shapes[2].unseen = true;
    scene.shapes[2].to_world = Transform::translate(10, 20, 30) * Transform::scale(-2, 2, 2);
    scene.shapes[0].unseen = true;  // does not shine either
    scene.lights.push_back(unseen(sphere_light({1, 2, 3}, 0.5f, {{1, 1, 1}})));
    const Gathered result = gathered(scene);
    EXPECT_EQ(result.spheres, 1u);
    EXPECT_EQ(result.triangles, 18u + 1);
    ASSERT_EQ(result.lights.size(), 1u + 20 + 3);
    EXPECT_EQ(result.lights[0].kind, RP_LIGHT_SPHERE);
    EXPECT_EQ(result.lights[0].flags, RP_LIGHT_TWO_SIDED);
    for (uint32_t i = 1; i <= 20; i++) {
        const rp_light& light = result.lights[i];
        EXPECT_EQ(light.kind, RP_LIGHT_TRIANGLE);
        EXPECT_EQ(light.flags, RP_LIGHT_UNSEEN);
        EXPECT_EQ(light.radiance[1], 2.0f);
        EXPECT_GT(light.area, 0);
        EXPECT_GT(light.probability, 0);
        // Twice as large around its new place, and it still shines outwards, though mirrored.
        const double at[3] = {light.p[0] - 10.0, light.p[1] - 20.0, light.p[2] - 30.0};
        EXPECT_NEAR(std::hypot(at[0], at[1], at[2]), 2, 1e-5);
        const double side = (double(light.e1[1]) * light.e2[2] - double(light.e1[2]) * light.e2[1]) * at[0] +
                            (double(light.e1[2]) * light.e2[0] - double(light.e1[0]) * light.e2[2]) * at[1] +
                            (double(light.e1[0]) * light.e2[1] - double(light.e1[1]) * light.e2[0]) * at[2];
        EXPECT_GT(side, 0);
    }
    EXPECT_EQ(result.lights[23].flags, RP_LIGHT_UNSEEN);
    for (const rp_primitive_range& range : result.ranges) EXPECT_TRUE(range.first_light == RP_NONE || range.first_light == 0);
}

TEST(Lights, UnseenMeshesMayHaveFaults) {
    TriangleMesh mesh = one_triangle();
    mesh.positions.push_back({NAN, 0, 0});
    mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 1}};
    Scene scene = scene_of({mesh_shape(mesh, "lamp.ply")});
    scene.area_lights = {{{1, 1, 1}, false}};
    scene.shapes[0].area_light = 0;
    scene.shapes[0].unseen = true;
    const Gathered result = gathered(scene);
    EXPECT_EQ(result.lights.size(), 1u);
    EXPECT_EQ(result.triangles, 0u);
    EXPECT_TRUE(result.issues.any());
    scene.shapes[0].to_world = Transform::scale(1e30, 1, 1);
    const auto far = gather(scene, [](double) {});
    ASSERT_FALSE(far.ok());
    EXPECT_NE(far.status().message().find("lamp.ply"), std::string::npos);
}

TEST(Lights, ProbabilitiesFollowPowerAndKind) {
    const Gathered result = gathered(scene_with_lights());
    double sum = 0, area_of_mesh = 0, probability_of_mesh = 0;
    for (uint32_t i = 0; i < result.lights.size(); i++) {
        sum += result.lights[i].probability;
        EXPECT_GT(result.lights[i].probability, 0);
        if (i < 20) area_of_mesh += result.lights[i].area, probability_of_mesh += result.lights[i].probability;
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    const double pi = std::numbers::pi, y = 0.2126 + 2 * 0.7152 + 3 * 0.0722;
    const double mesh = pi * area_of_mesh * y, sphere = 2 * pi * 16 * pi * 4, point = 4 * pi * 10 * 0.7152, total = mesh + sphere + point;
    // Half by power; half over two groups, surfaces and the point light, and by power within. The even share is 1e-6 in all.
    EXPECT_NEAR(probability_of_mesh, 0.5 * mesh / total + 0.25 * mesh / (mesh + sphere), 2e-6);
    EXPECT_NEAR(result.lights[20].probability, 0.5 * sphere / total + 0.25 * sphere / (mesh + sphere), 2e-6);
    EXPECT_NEAR(result.lights[21].probability, 0.5 * point / total + 0.25, 2e-6);
    EXPECT_NEAR(result.lights[22].probability, 1e-6 / 23, 1e-8);
}

TEST(Lights, NothingShines) {
    std::vector<rp_light> lights(4);
    for (rp_light& light : lights) light.kind = RP_LIGHT_POINT;
    set_probabilities(lights, 1);
    for (const rp_light& light : lights) EXPECT_EQ(light.probability, 0.25f);
    std::vector<rp_light> none;
    set_probabilities(none, 1);
}

TEST(Octahedral, RoundTrip) {
    constexpr uint32_t seed = 3;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 100000; i++) {
        double v[3] = {normal(random), normal(random), normal(random)};
        if (i % 10 == 0) v[i / 10 % 3] = 0;
        const double length = std::hypot(v[0], v[1], v[2]);
        const Float3 n = decode_octahedral(encode_octahedral(v[0], v[1], v[2]));
        const double dot = (n.x * v[0] + n.y * v[1] + n.z * v[2]) / length;
        // Half a step of 1 / 32767 in either coordinate, stretched by at most 2 on the sphere: an angle below 7e-5.
        ASSERT_GT(dot, 1 - 7e-5 * 7e-5 / 2 - 1e-7) << "seed " << seed << ", vector " << i;
    }
    EXPECT_EQ(encode_octahedral(0, 0, 0), RP_NONE);
    EXPECT_EQ(encode_octahedral(NAN, 0, 0), RP_NONE);
    // The vector whose code would be RP_NONE.
    const double t = -1.0 / 32767;
    EXPECT_NE(encode_octahedral(t, t, 1 + 2 * t), RP_NONE);
}

}  // namespace
}  // namespace raypager
