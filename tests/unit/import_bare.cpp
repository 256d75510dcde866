// Bare meshes get a camera, a light and a ground that suit them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "import/mesh_sample.hpp"
#include "raypager/import.hpp"
#include "scene/vector.hpp"
#include "support/temporary_folder.hpp"
#include "unit/import_files.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;
using test::make_box;

struct ImagePoint {
    double u = 0, v = 0, depth = 0;  // inside the frame: 0 to 1, depth positive
};

ImagePoint project(const Camera& c, const Float3& p) {
    const double d[3] = {double{p.x} - c.eye.x, double{p.y} - c.eye.y, double{p.z} - c.eye.z};
    const auto along = [&](const Float3& axis) {  // in units of the axis
        return (d[0] * axis.x + d[1] * axis.y + d[2] * axis.z) / (double{axis.x} * axis.x + double{axis.y} * axis.y + double{axis.z} * axis.z);
    };
    const double depth = along(c.forward);
    return {0.5 + 0.5 * along(c.right) / depth, 0.5 - 0.5 * along(c.up) / depth, depth};
}

// All triangles' corners of one shape, in the world.
std::vector<Float3> world_points(const Shape& shape) {
    TriangleMesh mesh;
    MeshIssues issues;
    EXPECT_TRUE(shape.mesh->load(mesh, issues).ok());
    std::vector<Float3> points;
    for (const Float3& p : mesh.positions) {
        const auto q = shape.to_world.point(p.x, p.y, p.z);
        points.push_back({float(q[0]), float(q[1]), float(q[2])});
    }
    return points;
}

class ImportBare : public testing::Test {
protected:
    Scene frame(const std::vector<TriangleMesh>& meshes, const BareLook& look = {}) {
        std::vector<std::filesystem::path> paths;
        for (size_t i = 0; i < meshes.size(); ++i) paths.push_back(folder.write(std::to_string(i) + ".ply", test::to_ply_binary(meshes[i])));
        auto scene = import_scene(paths, {default_keep_bytes, look, {}});
        EXPECT_TRUE(scene.ok()) << scene.status().message();
        return scene.ok() ? std::move(*scene) : Scene();
    }

    // What every framed scene must have.
    void check(const Scene& scene, size_t meshes) {
        ASSERT_EQ(scene.shapes.size(), meshes + 1);
        double left = 1, right = 0, top = 1, bottom = 0;
        for (size_t i = 0; i < meshes; ++i)
            for (const Float3& p : world_points(scene.shapes[i])) {
                const ImagePoint q = project(scene.camera, p);
                ASSERT_GT(q.depth, 0);
                left = std::min(left, q.u), right = std::max(right, q.u), top = std::min(top, q.v), bottom = std::max(bottom, q.v);
            }
        // The larger direction fills the middle 88 % of the frame, to single precision of the eye; the other stays within.
        const bool wide = right - left > bottom - top;
        EXPECT_NEAR(wide ? left : top, 0.06, 0.003);
        EXPECT_NEAR(wide ? right : bottom, 0.94, 0.003);
        EXPECT_GT(wide ? top : left, 0.06);
        EXPECT_LT(wide ? bottom : right, 0.94);
        // The lamp shines on them, and is no geometry.
        ASSERT_EQ(scene.lights.size(), 3u);
        EXPECT_EQ(scene.lights[0].kind, RP_LIGHT_INFINITE);
        const Vector at = vector(world_points(scene.shapes[0])[0]);
        for (const rp_light& half : {scene.lights[1], scene.lights[2]}) {
            EXPECT_EQ(half.kind, RP_LIGHT_TRIANGLE);
            EXPECT_EQ(half.flags, RP_LIGHT_UNSEEN);
            const Vector p = {half.p[0], half.p[1], half.p[2]}, e1 = {half.e1[0], half.e1[1], half.e1[2]}, e2 = {half.e2[0], half.e2[1], half.e2[2]};
            EXPECT_NEAR(half.area, 0.5 * length(cross(e1, e2)), 1e-5 * half.area);
            EXPECT_GT(half.area, 0);
            EXPECT_GT(dot(cross(e1, e2), at - p), 0);
            EXPECT_GT(half.radiance[0], 0);
        }
    }

    // Lowest coordinate of the object minus height of the ground.
    static double gap(const Scene& scene, float Float3::*up) {
        double lowest = 1e30;
        for (size_t i = 0; i + 1 < scene.shapes.size(); ++i)
            for (const Float3& p : world_points(scene.shapes[i])) lowest = std::min(lowest, double{p.*up});
        const auto ground = world_points(scene.shapes.back());
        for (const Float3& p : ground) EXPECT_EQ(p.*up, ground[0].*up);
        return lowest - ground[0].*up;
    }

    TemporaryFolder folder;
};

// A pyramid that stands on its base along the given axis.
TriangleMesh make_pyramid(bool z_up) {
    TriangleMesh mesh;
    for (const auto& [a, b, height] : {std::array{-1.f, -1.f, 0.f}, {1.f, -1.f, 0.f}, {1.f, 1.f, 0.f}, {-1.f, 1.f, 0.f}, {0.f, 0.f, 1.5f}})
        mesh.positions.push_back(z_up ? Float3{a, b, height} : Float3{b, height, a});
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    return mesh;
}

TEST_F(ImportBare, StandingObjects) {
    for (const bool z_up : {false, true}) {
        SCOPED_TRACE(z_up);
        const Scene scene = frame({make_pyramid(z_up)});
        check(scene, 1);
        const double below = gap(scene, z_up ? &Float3::z : &Float3::y);
        EXPECT_GT(below, 0);
        EXPECT_LT(below, 0.01);
        EXPECT_GT(z_up ? scene.camera.eye.z : scene.camera.eye.y, 0.5) << "seen from above";
        EXPECT_GT((z_up ? scene.camera.up.z : scene.camera.up.y), 0);
    }
}

TEST_F(ImportBare, TheCameraIsNotMirrored) {
    const Camera c = frame({make_pyramid(false)}).camera;
    const auto cross_x = c.forward.y * c.up.z - c.forward.z * c.up.y, cross_y = c.forward.z * c.up.x - c.forward.x * c.up.z,
               cross_z = c.forward.x * c.up.y - c.forward.y * c.up.x;
    EXPECT_GT(cross_x * c.right.x + cross_y * c.right.y + cross_z * c.right.z, 0);
}

TEST_F(ImportBare, TerrainsLieFlat) {
    for (const bool z_up : {false, true}) {
        SCOPED_TRACE(z_up);
        TriangleMesh mesh;
        constexpr uint32_t side = 20;
        for (uint32_t i = 0; i < side * side; ++i) {
            const float a = float(i % side), b = float(i / side), height = std::sin(a) * std::cos(b);
            mesh.positions.push_back(z_up ? Float3{a, b, height} : Float3{b, height, a});
        }
        for (uint32_t y = 0; y + 1 < side; ++y)
            for (uint32_t x = 0; x + 1 < side; ++x) {
                const uint32_t i = y * side + x;
                mesh.triangles.push_back({i, i + 1, i + side});
                mesh.triangles.push_back({i + 1, i + side + 1, i + side});
            }
        const Scene scene = frame({mesh});
        check(scene, 1);
        EXPECT_GT(gap(scene, z_up ? &Float3::z : &Float3::y), 0);
    }
}

TEST_F(ImportBare, SeveralMeshesAreFramedTogether) {
    TriangleMesh far = make_box();
    for (Float3& p : far.positions) p.x += 10;
    check(frame({make_box(), far}), 2);
}

// Pictures of any shape hold the whole object, and it fills them as well as their shape allows.
TEST_F(ImportBare, PicturesOfAnyShape) {
    for (const auto& [width, height] : {std::pair(1280u, 720u), {600u, 600u}, {720u, 1280u}, {400u, 100u}, {100u, 400u}})
        for (const auto& mesh : {make_box(1, 1, 1), make_box(5, 1, 1), make_box(1, 5, 1)}) {
            SCOPED_TRACE(testing::Message() << width << "x" << height);
            BareLook look;
            look.width = width;
            look.height = height;
            const Scene scene = frame({mesh}, look);
            EXPECT_EQ(scene.width, width);
            EXPECT_EQ(scene.height, height);
            check(scene, 1);
        }
}

// What a view or a look changes is no geometry: it must not be baked again.
TEST_F(ImportBare, GeometryIsTheSameInEveryPictureAndLight) {
    const Scene usual = frame({make_box()});
    BareLook look;
    look.width = 90;
    look.height = 160;
    look.material = rp_material{};
    look.sky = Float3{1, 2, 3};
    look.light.kind = BareLight::Kind::sun;
    const Scene other = frame({make_box()}, look);
    ASSERT_EQ(usual.shapes.size(), other.shapes.size());
    EXPECT_EQ(world_points(usual.shapes[1]), world_points(other.shapes[1]));
    EXPECT_EQ(usual.shapes[0].material, other.shapes[0].material);
    EXPECT_TRUE(usual.shapes[1].backdrop);
    EXPECT_FALSE(usual.shapes[0].backdrop);
}

TEST_F(ImportBare, LooksAreAsTheySay) {
    BareLook look;
    look.no_ground = true;
    look.sky = Float3{0, 0, 0};
    look.light.kind = BareLight::Kind::sun;
    look.light.place = BareLight::Place{90, 30};
    look.light.strength = 2;
    look.material = rp_material{};
    look.material->kind = RP_MATERIAL_DIELECTRIC;
    look.material->ior = 1.25f;
    const Scene scene = frame({make_box(), make_box(2, 2, 2)}, look);
    ASSERT_EQ(scene.shapes.size(), 2u);
    for (const Shape& shape : scene.shapes) EXPECT_EQ(scene.materials[shape.material].ior, 1.25f);
    ASSERT_EQ(scene.lights.size(), 1u);
    const rp_light& sun = scene.lights[0];
    EXPECT_EQ(sun.kind, RP_LIGHT_DISTANT);
    EXPECT_NEAR(sun.p[1], 0.5, 1e-6) << "30 degrees up";
    const Vector right = unit(vector(scene.camera.right));
    EXPECT_NEAR(dot({sun.p[0], sun.p[1], sun.p[2]}, right), std::cos(std::numbers::pi / 6), 1e-5) << "from the right";
    EXPECT_NEAR(sun.radiance[0], 5.8, 1e-5);

    look.light = {};
    look.light.kind = BareLight::Kind::none;
    const Scene dark = frame({make_box()}, look);
    EXPECT_TRUE(dark.lights.empty());
    ASSERT_EQ(dark.warnings.size(), 1u);
    EXPECT_NE(dark.warnings[0].find("black"), std::string::npos);
}

TEST_F(ImportBare, AnySizeAndPlace) {
    for (const float scale : {1e-12f, 1e-3f, 1.0f, 1e6f, 1e15f}) {
        SCOPED_TRACE(scale);
        check(frame({make_box(scale, 2 * scale, 3 * scale)}), 1);
    }
    TriangleMesh far = make_box(100, 200, 300);
    for (Float3& p : far.positions) p.x += 500000, p.z -= 5000000;  // a projected map
    // Single precision leaves half a unit at 5e6, of 400 units in the frame.
    const Scene scene = frame({far});
    ASSERT_EQ(scene.shapes.size(), 2u);
    for (const Float3& p : world_points(scene.shapes[0])) {
        const ImagePoint q = project(scene.camera, p);
        EXPECT_TRUE(q.depth > 0 && q.u > 0 && q.u < 1 && q.v > 0 && q.v < 1) << q.u << " " << q.v;
    }
}

TEST_F(ImportBare, FlatAndThinThings) {
    TriangleMesh triangle;
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    check(frame({triangle}), 1);
    triangle.positions = {{0, 0, 0}, {0, 1, 0}, {0, 0.5f, 1e-6f}};
    check(frame({triangle}), 1);
}

TEST_F(ImportBare, NothingToSeeIsAnError) {
    TriangleMesh line;
    line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    line.triangles = {{0, 1, 2}};
    const auto path = folder.write("line.ply", test::to_ply_binary(line));
    const auto scene = import_scene({path});
    ASSERT_FALSE(scene.ok());
    EXPECT_NE(scene.status().message().find("line.ply: has no triangle that can be seen: 1 degenerate triangle dropped"), std::string::npos)
        << scene.status().message();
    const auto vast = folder.write("vast.ply", test::to_ply_binary(make_box(1e30f, 1e30f, 1e30f)));
    EXPECT_NE(import_scene({vast}).status().message().find("scale it down"), std::string::npos);
}

// A square of n x n cells with hills, counter-clockwise seen from +z.
TriangleMesh make_sheet(uint32_t n) {
    TriangleMesh mesh;
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) {
            const float x = 10.0f * float(i) / float(n), y = 10.0f * float(j) / float(n);
            mesh.positions.push_back({x, y, 0.2f * std::sin(x) * std::sin(y)});
        }
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t a = j * (n + 1) + i, c = a + n + 1;
            mesh.triangles.push_back({a, a + 1, c});
            mesh.triangles.push_back({a + 1, c + 1, c});
        }
    return mesh;
}

double area_along_z(const TriangleMesh& mesh) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
        const Float3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        sum += 0.5 * ((double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x));
    }
    return sum;
}

TEST(MeshSample, StandsForTheWhole) {
    TriangleMesh sheet = make_sheet(120);
    sheet.triangles[77] = {0, 1, 1u << 20};
    const MeshInMemory whole("sheet", sheet);
    constexpr uint64_t most = 1000;
    MeshIssues issues;
    const auto sample = sample_mesh(whole, most, issues);
    ASSERT_TRUE(sample.ok()) << sample.status().message();
    EXPECT_LE(sample->mesh.triangles.size(), most);
    EXPECT_GT(sample->mesh.triangles.size(), most * 9 / 10);
    EXPECT_NEAR(sample->triangles * double(sample->mesh.triangles.size()), double(sheet.triangles.size()), 0.01 * double(sheet.triangles.size()));
    EXPECT_NEAR(sample->triangles * area_along_z(sample->mesh), 100, 2);
    EXPECT_EQ(sample->lower.x, 0);
    EXPECT_EQ(sample->upper.y, 10);
    // Its triangles are some of the sheet's, and come from all over it: each sixteenth of the square has about a sixteenth of them.
    int in_square[4][4] = {};
    for (const Triangle& t : sample->mesh.triangles) {
        const Float3 &a = sample->mesh.positions[t[0]], &b = sample->mesh.positions[t[1]], &c = sample->mesh.positions[t[2]];
        EXPECT_NEAR((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x), 100.0 / (120 * 120), 1e-5);
        in_square[int((a.x + b.x + c.x) / 3 / 2.5f)][int((a.y + b.y + c.y) / 3 / 2.5f)]++;
    }
    for (const auto& row : in_square)
        for (const int count : row) EXPECT_NEAR(count, double(sample->mesh.triangles.size()) / 16, 30);  // four standard deviations of strewn ones
    // All of them, where there are few.
    const auto all = sample_mesh(whole, sheet.triangles.size(), issues);
    ASSERT_TRUE(all.ok());
    EXPECT_EQ(all->mesh.triangles.size(), sheet.triangles.size() - 1);
    EXPECT_GE(issues.bad_index, 1u);
    EXPECT_EQ(all->triangles, 1);
}

// So large that a sample decides; but it is seen as the same shape in few triangles is.
TEST_F(ImportBare, LargeMeshesAreFramedByASample) {
    const Scene small = frame({make_sheet(40)}), large = frame({make_sheet(730)});
    check(large, 1);
    EXPECT_NEAR(large.camera.eye.x, small.camera.eye.x, 0.02);
    EXPECT_NEAR(large.camera.eye.y, small.camera.eye.y, 0.02);
    EXPECT_NEAR(large.camera.eye.z, small.camera.eye.z, 0.02);
}

}  // namespace
}  // namespace raypager
