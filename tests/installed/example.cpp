// A scene is built in memory, baked in memory, and rendered step by step with a quarter of its geometry on the device.
#include <cmath>
#include <cstdio>
#include <memory>

#include "raypager/raypager.hpp"

using namespace raypager;

// A wavy square of side 2, of 2 n^2 triangles.
static TriangleMesh waves(uint32_t n) {
    TriangleMesh mesh;
    for (uint32_t y = 0; y <= n; y++)
        for (uint32_t x = 0; x <= n; x++) {
            const float u = 2.f * static_cast<float>(x) / static_cast<float>(n) - 1, v = 2.f * static_cast<float>(y) / static_cast<float>(n) - 1;
            mesh.positions.push_back({u, 0.05f * std::sin(20 * u) * std::cos(20 * v), v});
        }
    for (uint32_t y = 0; y < n; y++)
        for (uint32_t x = 0; x < n; x++) {
            const uint32_t a = y * (n + 1) + x, b = a + n + 1;
            mesh.triangles.push_back({a, b, a + 1});
            mesh.triangles.push_back({a + 1, b, b + 1});
        }
    return mesh;
}

static Result<RenderResult> run() {
    Scene scene;
    scene.width = 320, scene.height = 180, scene.spp = 16;
    const auto camera = make_camera({0, 1, 2}, {0, 0, 0}, {0, 1, 0}, 45, scene.width, scene.height);
    if (!camera) return Status::usage("the camera has no direction");
    scene.camera = *camera;
    scene.materials = {diffuse_material({0.8f, 0.6f, 0.4f})};
    scene.lights = {infinite_light({1, 1, 1})};
    Shape& shape = scene.shapes.emplace_back();
    shape.mesh = std::make_shared<MeshInMemory>("waves", waves(400));

    auto baked = bake(scene, BakeOptions());
    if (!baked) return baked.status();
    RenderOptions options;
    options.geometry_limit_percent = 25;
    auto session = Session::create(baked->blocks, options);
    if (!session) return session.status();
    while (!session->done()) {
        RAYPAGER_TRY(session->step(0.5));
        std::printf("%.0f %%\n", 100 * session->progress().fraction);
    }
    return session->finish();
}

int main() {
    const auto result = run();
    const Status status = result ? write_image("waves.pfm", result->image) : result.status();
    if (!status) {
        std::fprintf(stderr, "%s\n", status.message().c_str());
        return status.exit_code();
    }
    std::printf("waves.pfm: %u samples per pixel, %llu loads\n", result->report.spp, (unsigned long long)result->report.paging.loads);
}
