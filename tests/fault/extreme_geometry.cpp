// Geometry at the edge of what floats hold: baked and rendered, it ends in a picture of finite values that is the same when it is paged,
// or it is refused in one line. Never a hang, never a NaN.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using blocks_test::mesh_shape;
using blocks_test::soup;
using blocks_test::sphere_shape;

struct Case {
    const char* name;
    std::vector<Shape> shapes;
    double size;                         // of what the camera looks at, around the origin
    std::optional<uint64_t> primitives;  // that remain; nothing: the baker must refuse
};

TriangleMesh scaled(TriangleMesh mesh, float factor, Float3 offset = {}) {
    for (Float3& p : mesh.positions) p = {p.x * factor + offset.x, p.y * factor + offset.y, p.z * factor + offset.z};
    return mesh;
}

// The same triangle again and again: no cut can part them.
TriangleMesh stack_of(uint32_t count) {
    TriangleMesh mesh{{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, {}, {}};
    mesh.triangles.assign(count, {0, 1, 2});
    return mesh;
}

// From one point outwards, each a thousand times as long as it is wide and on.
TriangleMesh needles(uint32_t count) {
    TriangleMesh mesh;
    for (uint32_t i = 0; i < count; i++) {
        const float a = 6.2831853f * static_cast<float>(i) / static_cast<float>(count), width = std::ldexp(1e-3f, -static_cast<int>(i % 100));
        mesh.positions.insert(mesh.positions.end(), {{0, 0, 0}, {std::cos(a), std::sin(a), 0}, {std::cos(a), std::sin(a), width}});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return mesh;
}

TriangleMesh with_vertex(TriangleMesh mesh, Float3 vertex) {
    mesh.positions[mesh.triangles[0][0]] = vertex;
    return mesh;
}

std::vector<Case> make_cases() {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    std::vector<Case> list;
    const auto add = [&](const char* name, TriangleMesh mesh, double size, std::optional<uint64_t> primitives) {
        list.push_back({name, {mesh_shape(std::move(mesh))}, size, primitives});
    };
    add("denormal", scaled(soup(2000, 1), 1e-40f), 1e-40, 2000);
    add("tiny", scaled(soup(2000, 1), 1e-30f), 1e-30, 2000);
    add("large", scaled(soup(2000, 1), 9e11f), 9e11, 2000);
    add("too large", scaled(soup(2000, 1), 1e30f), 1e30, std::nullopt);
    add("far away", scaled(soup(2000, 1), 100, {1e5f, 1e5f, 1e5f}), 1e5, 2000);
    add("a NaN", with_vertex(soup(2000, 1), {nan, 0, 0}), 1, 1999);
    add("an infinity", with_vertex(soup(2000, 1), {0, infinity, 0}), 1, 1999);
    add("from the smallest to the largest", with_vertex(with_vertex(soup(2000, 1), {1e12f, 1e-45f, -1e12f}), {1e12f, 1e-45f, -1e12f}), 1, 2000);
    add("one place", stack_of(5000), 1, 5000);
    add("needles", needles(3000), 1, 3000);
    add("nothing but points", TriangleMesh{std::vector<Float3>(3000, {1, 1, 1}), std::vector<Triangle>(1000, {0, 1, 2}), {}}, 1, 0);
    list.push_back({"spheres", {sphere_shape({0, 0, 0}, 1e-38f), sphere_shape({0, 0, 1}, 1e11f), sphere_shape({1e11f, 0, 0}, 1e-45f)}, 1, 3});
    list.push_back({"flattened", {mesh_shape(soup(2000, 1))}, 1, 2000});
    list.back().shapes[0].to_world = Transform::scale(1, 1, 1e-300);
    return list;
}

// Every process of these tests asks for the names of all, which takes a third of a second if they are made anew for each.
const std::vector<Case>& cases() {
    static const std::vector<Case> list = make_cases();
    return list;
}

class ExtremeGeometryOnDevice : public testing::TestWithParam<size_t> {};

TEST_P(ExtremeGeometryOnDevice, IsRefusedOrRendered) {
    const Case& c = cases()[GetParam()];
    SCOPED_TRACE(c.name);
    Scene scene = blocks_test::scene_of(c.shapes);
    rp_light sky = {};
    sky.kind = RP_LIGHT_INFINITE;
    sky.radiance[0] = sky.radiance[1] = sky.radiance[2] = 1;
    scene.lights = {sky};
    scene.width = 12;
    scene.height = 8;
    scene.spp = 2;
    const auto f = static_cast<float>(c.size);
    scene.camera = {{0, 0, -3 * f}, {f, 0, 0}, {0, f, 0}, {0, 0, 2 * f}};
    if (c.size < 1e-30) scene.camera = {{0, 0, -1}, {1e-10f, 0, 0}, {0, 1e-10f, 0}, {0, 0, 1}};
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    const auto summary = bake(scene, bake_options, folder / "extreme.rpb");
    ASSERT_EQ(summary.ok(), c.primitives.has_value()) << summary.status().message();
    if (!summary.ok()) return;
    EXPECT_EQ(summary->triangles + summary->spheres, *c.primitives);
    const auto file = BlockFile::open(folder / "extreme.rpb");
    ASSERT_TRUE(file.ok()) << file.status().message();
    RenderOptions options;
    options.tuning.paths = 64;
    const auto resident = render(**file, options, {});
    ASSERT_TRUE(resident.ok()) << resident.status().message();
    for (const float value : resident->image.values) ASSERT_TRUE(std::isfinite(value) && value >= 0);
    options.geometry_limit_percent = 1;
    options.tuning.policy = PolicyKind::lru;
    const auto paged = render(**file, options, {});
    ASSERT_TRUE(paged.ok()) << paged.status().message();
    EXPECT_EQ(paged->report.film_hash, resident->report.film_hash);
}

std::string case_name(const testing::TestParamInfo<size_t>& info) {
    std::string name = cases()[info.param].name;
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}
INSTANTIATE_TEST_SUITE_P(Cases, ExtremeGeometryOnDevice, testing::Range<size_t>(0, cases().size()), case_name);

}  // namespace
}  // namespace raypager
