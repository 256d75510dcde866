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
    scene.camera = *make_camera({0, 1, 2}, {0, 0, 0}, {0, 1, 0}, 45, 320, 180);
    scene.materials = {diffuse_material({0.8f, 0.6f, 0.4f})};
    scene.lights = {infinite_light({1, 1, 1})};
    Shape& shape = scene.shapes.emplace_back();
    shape.mesh = std::make_shared<MeshInMemory>("waves", waves(400));

    auto baked = bake(scene, BakeOptions());
    if (!baked) return baked.status();
    RenderOptions options;
    options.width = 320, options.height = 180, options.spp = 16;
    options.geometry_limit_percent = 25;
    auto session = Session::create(baked->blocks, options);
    if (!session) return session.status();
    for (;;) {
        const auto more = session->step(0.5);
        if (!more) return more.status();
        if (!*more) return session->finish();
        std::printf("%.0f %%\n", 100 * session->progress().fraction);
    }
}

int main() {
    const auto result = run();
    const Status status = result ? write_image("waves.pfm", result->image) : result.status();
    if (!status) return std::fprintf(stderr, "%s\n", status.message().c_str()), status.exit_code();
    std::printf("waves.pfm: %u samples per pixel, %llu loads\n", result->report.spp, (unsigned long long)result->report.paging.loads);
}
