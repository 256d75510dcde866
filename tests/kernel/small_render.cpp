// All kernels on a scene so small that a simulator such as oclgrind gets through it: two slabs, a pool for a fraction of the blocks,
// every material, every kind of light.
#include <gtest/gtest.h>

#include <cmath>

#include "render/render.hpp"
#include "support/device_scene.hpp"

namespace raypager {
namespace {

rp_material material(uint32_t kind, float alpha = 0) {
    rp_material m = {};
    m.kind = kind;
    m.alpha = alpha;
    m.ior = 1.5f;
    for (int k = 0; k < 3; k++) {
        m.color[k] = 0.6f;
        m.eta[k] = 0.3f;
        m.k[k] = 3.0f;
    }
    return m;
}

rp_light light(uint32_t kind, Float3 p, float radiance) {
    rp_light l = {};
    l.kind = kind;
    l.p[0] = p.x;
    l.p[1] = p.y;
    l.p[2] = p.z;
    for (float& channel : l.radiance) channel = radiance;
    return l;
}

// About 2 n^2 triangles: a wavy plane, a patch of it with shading normals, four spheres, two rows of points, a triangle that shines.
Scene small_scene(uint32_t n) {
    Scene scene;
    scene.materials = {material(RP_MATERIAL_DIFFUSE), material(RP_MATERIAL_CONDUCTOR), material(RP_MATERIAL_CONDUCTOR, 0.2f),
                       material(RP_MATERIAL_DIELECTRIC)};
    TriangleMesh waves;
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j <= n; j++) {
            const float x = 4.0f * static_cast<float>(i) / static_cast<float>(n) - 2, z = 4.0f * static_cast<float>(j) / static_cast<float>(n) - 2;
            waves.positions.push_back({x, 0.2f * std::sin(5 * x) * std::cos(4 * z), z});
            waves.normals.push_back({0, 1, 0});
        }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++) {
            const uint32_t a = i * (n + 1) + j, b = a + n + 1;
            waves.triangles.push_back({a, a + 1, b + 1});
            waves.triangles.push_back({a, b + 1, b});
        }
    Shape shape;
    shape.mesh = std::make_shared<MeshInMemory>("waves", waves);
    scene.shapes.push_back(shape);
    shape.mesh = nullptr;
    for (uint32_t i = 0; i < 4; i++) {
        shape.material = i;
        shape.sphere = {{-1.2f + 0.8f * static_cast<float>(i), 0.6f, 0.3f * static_cast<float>(i % 2)}, 0.35f};
        scene.shapes.push_back(shape);
    }
    shape.material = 0;
    std::vector<CloudPoint> points;
    for (uint32_t i = 0; i < 40; i++) points.push_back({{0.1f * static_cast<float>(i) - 2, 0.4f, -1}, 0, 0x80c0ffu - 0x050301u * i});
    for (const bool color : {false, true}) {
        shape.points = std::make_shared<PointsInMemory>("points", points, color);
        scene.shapes.push_back(shape);
        for (CloudPoint& point : points) point.position.y += 0.3f;
    }
    shape.points = nullptr;
    shape.mesh = std::make_shared<MeshInMemory>("lamp", TriangleMesh{{{-1, 3, -1}, {1, 3, -1}, {0, 3, 1}}, {{0, 1, 2}}, {}});
    shape.area_light = 0;
    scene.area_lights.push_back({{10, 10, 10}, true});
    scene.shapes.push_back(shape);
    scene.lights = {light(RP_LIGHT_INFINITE, {}, 0.3f), light(RP_LIGHT_DISTANT, {0, 0.8f, 0.6f}, 1), light(RP_LIGHT_POINT, {1, 2, -1}, 2)};
    scene.width = 12;
    scene.height = 8;
    scene.camera = *make_camera({0, 2, -4}, {0, 0.3f, 0}, {0, 1, 0}, 40, scene.width, scene.height);
    return scene;
}

TEST(SmallRender, pages_every_stage_and_matches_the_resident_picture) {
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(small_scene(40), bake_options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    ASSERT_GE((*file)->scene().blocks.size(), 4u);
    RenderOptions options;
    options.spp = 1;
    options.paths = 64;
    const auto resident = render(**file, options, {});
    ASSERT_TRUE(resident.ok()) << resident.status().message();
    options.geometry_limit_percent = 60;
    options.slab_bytes = (*file)->scene().largest_block() + 64;
    const auto paged = render(**file, options, {});
    ASSERT_TRUE(paged.ok()) << paged.status().message();
    EXPECT_GT(paged->report.paging.evictions, 0u);
    EXPECT_EQ(paged->report.film_hash, resident->report.film_hash);
    EXPECT_EQ(paged->report.clamped_samples, 0u);
}

TEST(SmallRender, an_empty_scene_is_its_background) {
    Scene scene = small_scene(2);
    scene.shapes.clear();
    const support::TemporaryFolder folder;
    auto file = support::bake_and_open(scene, {}, folder.path(), "empty");
    ASSERT_TRUE(file.ok()) << file.status().message();
    RenderOptions options;
    options.spp = 2;
    options.paths = 64;
    const auto result = render(**file, options, {});
    ASSERT_TRUE(result.ok()) << result.status().message();
    for (const float value : result->image.values) EXPECT_NEAR(value, 0.3f, 1e-6);
}

TEST(SmallRender, probe_traces_resident_blocks) {
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(small_scene(30), bake_options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    auto device = support::DeviceScene::create(*file);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto hits = (*device)->trace({{{-1.2f, 5, 0}, INFINITY, {0, -1, 0}}, {{0, 5, 0}, 1, {0, -1, 0}}, {{0, 5, 0}, INFINITY, {0, 1, 0}}});
    ASSERT_TRUE(hits.ok()) << hits.status().message();
    // The first sphere from above: its id follows those of the waves.
    EXPECT_EQ((*hits)[0].primitive, 2 * 30 * 30u);
    EXPECT_NEAR((*hits)[0].t, 5 - 0.95f, 1e-5);
    EXPECT_TRUE((*hits)[0].occluded);
    EXPECT_EQ((*hits)[1].primitive, RP_NONE);
    EXPECT_EQ((*hits)[2].primitive, RP_NONE);
}

}  // namespace
}  // namespace raypager
