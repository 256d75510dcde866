// bench export: what Mitsuba gets is what was baked, triangle by triangle, and the text names everything.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>

#include "bench/export.hpp"
#include "import/mesh_file.hpp"
#include "support/failing_file_system.hpp"
#include "unit/bake_scenes.hpp"
#include "unit/procedural_meshes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

using Corners = std::array<std::array<float, 3>, 3>;

// Each triangle's corners, turned so that the least comes first, all sorted.
std::vector<Corners> corners_of(const TriangleMesh& mesh) {
    std::vector<Corners> all;
    for (const Triangle& t : mesh.triangles) {
        Corners c;
        for (size_t i = 0; i < 3; ++i) c[i] = {mesh.positions[t[i]].x, mesh.positions[t[i]].y, mesh.positions[t[i]].z};
        std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
        all.push_back(c);
    }
    std::sort(all.begin(), all.end());
    return all;
}

class BenchExport : public testing::Test {
protected:
    BenchExport() {
        scene.materials = {gray(), gray(), gray()};
        scene.materials[1].kind = RP_MATERIAL_CONDUCTOR;
        scene.materials[1].alpha = 0.25f;
        std::fill_n(scene.materials[1].eta, 3, 2.0f);
        scene.materials[2].kind = RP_MATERIAL_DIELECTRIC;
        scene.materials[2].ior = 1.5f;
        scene.area_lights = {AreaLight{{4, 5, 6}, false}};
        rp_light sky{}, sun{};
        sky.kind = RP_LIGHT_INFINITE;
        sky.radiance[2] = 0.25f;
        sun.kind = RP_LIGHT_DISTANT;
        sun.p[1] = 1;
        sun.radiance[0] = 3;
        scene.lights = {sky, sun};
        scene.max_depth = 4;
        scene.width = 64, scene.height = 48;
        scene.shapes = {mesh_shape(soup(700, 1)), mesh_shape(terrain(20, true)), mesh_shape(icosphere(1)), mesh_shape(soup(300, 2)),
                        sphere_shape({0, 2, 0}, 0.5f)};
        scene.shapes[1].material = 1;
        scene.shapes[2].area_light = 0;
        scene.shapes[4].material = 2;
    }
    Result<bench::ExportSummary> run() {
        file = bake_and_open(scene, folder / "scene.rpb", 16 << 10);
        return bench::export_to_mitsuba(*file, folder / "out");
    }
    Scene scene;
    TemporaryFolder folder;
    std::shared_ptr<const BlockFile> file;
};

TEST_F(BenchExport, HasEveryTriangleOnceAndExactly) {
    const auto made = run();
    ASSERT_TRUE(made.ok()) << made.status().message();
    EXPECT_GT(file->scene().blocks.size(), 3u);
    EXPECT_EQ(made->triangles, 700u + 800u + 80u + 300u);
    EXPECT_EQ(made->spheres, 1u);
    const auto plain = procedural_test::read_ply(folder / "out/mesh0.ply"), light = procedural_test::read_ply(folder / "out/mesh2.ply");
    ASSERT_TRUE(plain && light);
    TriangleMesh gray_ones = soup(700, 1), other = soup(300, 2);
    const auto offset = static_cast<uint32_t>(gray_ones.positions.size());
    gray_ones.positions.insert(gray_ones.positions.end(), other.positions.begin(), other.positions.end());
    for (const Triangle& t : other.triangles) gray_ones.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    EXPECT_EQ(corners_of(*plain), corners_of(gray_ones)) << "two shapes of one material are one mesh";
    EXPECT_EQ(corners_of(*light), corners_of(icosphere(1))) << "counter-clockwise from outside still";

    const auto smooth = MeshFile::open(folder / "out/mesh1.ply");
    ASSERT_TRUE(smooth.ok()) << smooth.status().message();
    TriangleMesh mesh;
    MeshIssues issues;
    ASSERT_TRUE((*smooth)->load(mesh, issues).ok());
    EXPECT_EQ(corners_of(mesh), corners_of(terrain(20)));
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    // Octahedral codes keep normals to 1e-4.
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const Float3 p = mesh.positions[i], wanted = {0.1f * std::sin(3 * p.x), 1, 0.2f * std::cos(5 * p.z)}, n = mesh.normals[i];
        const float length = std::hypot(wanted.x, wanted.y, wanted.z);
        EXPECT_NEAR(n.x, wanted.x / length, 1e-4);
        EXPECT_NEAR(n.z, wanted.z / length, 1e-4);
    }
}

TEST_F(BenchExport, NamesEverything) {
    const auto made = run();
    ASSERT_TRUE(made.ok()) << made.status().message();
    const std::string text = *read_text(folder / "out/scene.xml");
    for (const char* part :
         {"<integer name=\"max_depth\" value=\"5\"/>", "<integer name=\"rr_depth\" value=\"2\"/>", "<rfilter type=\"box\"/>",
          "<default name=\"width\" value=\"64\"/>", "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"0 0 0.25\"/>",
          "<vector name=\"direction\" x=\"-0\" y=\"-1\" z=\"-0\"/><rgb name=\"irradiance\" value=\"3 0 0\"/>",
          "<emitter type=\"area\"><rgb name=\"radiance\" value=\"4 5 6\"/>", "<float name=\"alpha\" value=\"0.25\"/>",
          "<float name=\"int_ior\" value=\"1.5\"/>", "<point name=\"center\" x=\"0\" y=\"2\" z=\"0\"/><float name=\"radius\" value=\"0.5\"/>"})
        EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

TEST_F(BenchExport, PointsKeepTheirColors) {
    Shape cloud;
    cloud.name = "cloud";
    cloud.points =
        std::make_shared<PointsInMemory>("cloud", std::vector<CloudPoint>{{{0, 3, 0}, 0.25f, 0x0000ffu}, {{1, 3, 0}, 0.25f, 0xffff00u}}, true);
    scene.shapes.push_back(cloud);
    const auto made = run();
    ASSERT_TRUE(made.ok()) << made.status().message();
    EXPECT_EQ(made->spheres, 3u);
    const std::string text = *read_text(folder / "out/scene.xml");
    for (const char* color : {"1 0 0", "0 1 1"})
        EXPECT_NE(
            text.find(
                std::string(
                    "<float name=\"radius\" value=\"0.25\"/><bsdf type=\"twosided\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"") +
                color + "\"/>"),
            std::string::npos)
            << text;
}

TEST_F(BenchExport, RefusesWhatMitsubaHasNot) {
    scene.area_lights[0].two_sided = true;
    const auto made = run();
    ASSERT_FALSE(made.ok());
    EXPECT_NE(made.status().message().find("both sides"), std::string::npos);
}

TEST_F(BenchExport, AFullDiskIsAnError) {
    ASSERT_TRUE(run().ok());
    std::filesystem::remove_all(folder / "out");
    support::FailingFileSystem disk;
    disk.error_number = ENOSPC;
    disk.fail_write_in = 2;
    const auto made = bench::export_to_mitsuba(*file, folder / "out");
    ASSERT_FALSE(made.ok());
    EXPECT_NE(made.status().message().find("No space left"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder / "out/scene.xml"));
}

}  // namespace
}  // namespace raypager
