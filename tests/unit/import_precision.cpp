// Coordinates that are too large for single precision.
#include <gtest/gtest.h>

#include <cmath>

#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/import_files.hpp"
#include "unit/import_load.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;
using test::make_box;

// The box at map coordinates, as each format has it.
struct Surveyed {
    const char* file;
    std::string content;
};
std::string moved_text(const std::string& x, const std::string& y, const std::string& z) { return x + " " + y + " " + z + "\n"; }

std::vector<Surveyed> surveyed_boxes() {
    std::string vertices, obj, stl = "solid s\n", ply_data;
    std::vector<std::array<std::string, 3>> places;
    const TriangleMesh box = make_box(0.25f, 0.5f, 0.75f);
    for (const Float3& p : box.positions) {
        char text[3][40];
        std::snprintf(text[0], 40, "%.4f", 512345.0 + double{p.x});
        std::snprintf(text[1], 40, "%.4f", 5612345.0 + double{p.y});
        std::snprintf(text[2], 40, "%.4f", 120.0 + double{p.z});
        places.push_back({text[0], text[1], text[2]});
        vertices += moved_text(text[0], text[1], text[2]);
        obj += "v " + moved_text(text[0], text[1], text[2]);
        for (const double c : {512345.0 + double{p.x}, 5612345.0 + double{p.y}, 120.0 + double{p.z}}) ply_data += test::bytes_of(c);
    }
    std::string faces, ply_faces;
    for (const Triangle& t : box.triangles) {
        faces += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
        obj += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
        stl += "facet normal 0 0 0\nouter loop\n";
        ply_faces += "\3";
        for (const uint32_t v : t) {
            stl += "vertex " + moved_text(places[v][0], places[v][1], places[v][2]);
            ply_faces += test::bytes_of(v);
        }
        stl += "endloop\nendfacet\n";
    }
    const std::string header =
        " 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\nelement face 12\n"
        "property list uchar int vertex_indices\nend_header\n";
    return {{"a.obj", obj},
            {"a.off", "OFF\n8 12 0\n" + vertices + faces},
            {"a.stl", stl + "endsolid\n"},
            {"text.ply", "ply\nformat ascii" + header + vertices + faces},
            {"binary.ply", "ply\nformat binary_little_endian" + header + ply_data + ply_faces}};
}

TEST(ImportPrecision, SurveyedMeshesKeepTheirDigits) {
    const TemporaryFolder folder;
    for (const Surveyed& s : surveyed_boxes()) {
        SCOPED_TRACE(s.file);
        const auto scene = import_scene({folder.write(s.file, s.content)});
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        ASSERT_EQ(scene->warnings.size(), 1u);
        EXPECT_NE(scene->warnings[0].find("is far from the origin; coordinates are shown relative to (512000, 5612000, 0)"), std::string::npos)
            << scene->warnings[0];
        TriangleMesh mesh;
        MeshIssues issues;
        ASSERT_TRUE(scene->shapes[0].mesh->load(mesh, issues).ok());
        EXPECT_TRUE(scene->shapes[0].to_world.is_identity());
        const TriangleMesh box = make_box(0.25f, 0.5f, 0.75f);
        const auto found = test::corners(mesh), expected = test::corners(box);
        ASSERT_EQ(found.size(), expected.size());
        for (size_t t = 0; t < found.size(); ++t)
            for (size_t k = 0; k < 3; ++k) {
                EXPECT_EQ(found[t][k].x, expected[t][k].x + 345);
                EXPECT_EQ(found[t][k].y, expected[t][k].y + 345);
                EXPECT_EQ(found[t][k].z, expected[t][k].z + 120);
            }
    }
}

TEST(ImportPrecision, SeveralInputsShareOneOrigin) {
    const TemporaryFolder folder;
    const auto boxes = surveyed_boxes();
    TriangleMesh near = make_box();
    const auto cloud = folder.write("c.xyz", "514000.5 5613000 100\n514001.5 5613001 101\n514002.5 5613004 99\n514003 5613002 100\n");
    const auto scene = import_scene({folder.write("a.obj", boxes[0].content), cloud});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    // The cloud's is (514000, 5613000, 0), and the mesh is moved along.
    const auto p = scene->shapes[0].to_world.point(345, 345, 120);
    EXPECT_EQ(p, (std::array<double, 3>{512345 - 514000, 5612345 - 5613000, 120}));
}

TEST(ImportPrecision, DigitsThatAreLostAlreadyAreSaid) {
    TriangleMesh mesh = make_box(1, 1, 1);
    for (Float3& p : mesh.positions) p.x += 500000, p.y += 5000000;
    const auto loaded = test::load_text("a.ply", test::to_ply_binary(mesh));
    test::expect_warning(loaded, "single precision");
    for (Float3& p : mesh.positions) p.x = (p.x - 500000) * 1000, p.y = (p.y - 5000000) * 1000;
    EXPECT_TRUE(test::load_text("a.ply", test::to_ply_binary(mesh)).issues.warnings.empty());
}

std::string scene_text(double ground, double x, double distance) {
    const auto n = [](double v) { return std::to_string(v) + " "; };
    const std::string g = n(ground), minus = n(-ground);
    return "LookAt " + n(x) + "3 " + n(-distance) + n(x) + "1 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n" +
           "Shape \"trianglemesh\" \"point3 P\" [" + minus + "0 " + minus + g + "0 " + minus + g + "0 " + g + minus + "0 " + g +
           "] \"integer indices\" [0 1 2 0 2 3]\nTranslate " + n(x) + "1 0\nShape \"sphere\" \"float radius\" 1\n";
}

TEST(ImportPrecision, ScenesThatAreTooLargeForTheirSubjectAreWarnedOf) {
    const TemporaryFolder folder;
    const auto warnings = [&](const std::string& text) {
        const auto scene = import_scene({folder.write("a.pbrt", text)});
        EXPECT_TRUE(scene.ok()) << scene.status().message();
        size_t count = 0;
        for (const std::string& w : scene->warnings) count += w.find("precision") != std::string::npos;
        return count;
    };
    EXPECT_EQ(warnings(scene_text(300000, 0, 8)), 1u);
    EXPECT_EQ(warnings(scene_text(3000, 0, 8)), 0u);
    EXPECT_EQ(warnings(scene_text(2000000, 1000000, 8)), 1u) << "far from the origin";
    EXPECT_EQ(warnings(scene_text(300000, 0, 2000)), 0u) << "too small in the picture to matter";
}

}  // namespace
}  // namespace raypager
