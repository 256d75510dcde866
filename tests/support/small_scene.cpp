#include "support/small_scene.hpp"

#include <cmath>

namespace raypager::support {
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

}  // namespace

Scene small_scene(uint32_t n, bool colors) {
    Scene scene;
    scene.materials = {material(RP_MATERIAL_DIFFUSE), material(RP_MATERIAL_CONDUCTOR), material(RP_MATERIAL_CONDUCTOR, 0.2f),
                       material(RP_MATERIAL_DIELECTRIC)};
    TriangleMesh waves;
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j <= n; j++) {
            const float x = 4.0f * static_cast<float>(i) / static_cast<float>(n) - 2, z = 4.0f * static_cast<float>(j) / static_cast<float>(n) - 2;
            waves.positions.push_back({x, 0.2f * std::sin(5 * x) * std::cos(4 * z), z});
            waves.normals.push_back({0, 1, 0});
            if (colors) waves.colors.push_back(0x40ff20u + 0x030507u * (i * j % 16));
            if (colors) waves.uvs.push_back({x, 3 * z});
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

}  // namespace raypager::support
