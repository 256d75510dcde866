// Ptex textures of pbrt scenes, and coordinates of textures of the corners of PLY faces.
#include <gtest/gtest.h>

#include "image/ptex_atlas.hpp"
#include "raypager/import.hpp"
#include "support/ptex_writer.hpp"
#include "support/temporary_folder.hpp"
#include "unit/import_files.hpp"

namespace raypager {
namespace {

using support::PtexFace;
using support::PtexWriter;
using support::TemporaryFolder;

constexpr const char* three_faces =
    "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face 3\n"
    "property list uchar int vertex_indices\nproperty int face_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n2 1 0\n4 0 1 2 3 2\n4 1 4 5 2 0\n3 0 1 5 1\n";

std::string scene_with(const std::string& material, const std::string& shape = "Shape \"plymesh\" \"string filename\" \"mesh.ply\"\n") {
    return "WorldBegin\nLightSource \"point\"\nTexture \"paint\" \"spectrum\" \"ptex\" \"string filename\" \"paint.ptx\"\n"
           "Texture \"wear\" \"float\" \"ptex\" \"string filename\" \"wear.ptx\" \"string encoding\" \"linear\"\n" +
           material + shape;
}

class ImportPtex : public testing::Test {
protected:
    ImportPtex() {
        folder_.write("mesh.ply", three_faces);
        const std::vector<PtexFace> faces = {{2, 2}, {1, 1}, {3, 2}};
        const auto value = [](uint32_t f, uint32_t x, uint32_t, uint32_t c) { return 10 * f + x + 100 * c; };
        folder_.write("paint.ptx", PtexWriter::write({0, 3}, faces, value));
        folder_.write("wear.ptx", PtexWriter::write({1, 1}, faces, value));
        folder_.write("other.ptx", PtexWriter::write({0, 3}, {{2, 3}, {1, 1}, {3, 2}}, value));
    }
    Result<Scene> load(const std::string& text) { return import_scene({folder_.write("a.pbrt", text)}); }
    const TemporaryFolder folder_;
};

TEST_F(ImportPtex, CornersOfFacesLieWhereTheirTexelsAre) {
    const auto scene = load(scene_with("Material \"coateddiffuse\" \"texture reflectance\" \"paint\" \"texture roughness\" \"wear\"\n"));
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_TRUE(scene->warnings.empty()) << scene->warnings[0];
    ASSERT_EQ(scene->images.size(), 2u);
    const auto paint = std::dynamic_pointer_cast<const PtexAtlas>(scene->images[0]);
    ASSERT_TRUE(paint);
    ASSERT_EQ(scene->shapes.size(), 1u);
    TriangleMesh mesh;
    MeshIssues issues;
    ASSERT_TRUE(scene->shapes[0].mesh->load(mesh, issues).ok());
    ASSERT_EQ(mesh.triangles.size(), 5u);
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
    const Float2 square[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const uint32_t face_of[] = {2, 2, 0, 0, 1}, corners_of[][3] = {{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {0, 2, 3}, {0, 1, 2}};
    for (size_t t = 0; t < 5; t++)
        for (size_t k = 0; k < 3; k++) {
            const Float2 corner = square[corners_of[t][k]];
            EXPECT_EQ(mesh.uvs[mesh.triangles[t][k]], paint->place(face_of[t], corner.x, corner.y)) << "triangle " << t << ", corner " << k;
        }
    const auto files = scene->shapes[0].mesh->files();
    EXPECT_EQ(files.size(), 2u) << "the geometry depends on the Ptex file, too";
}

// As the island of Moana has them: triangles in the scene file that say which face they belong to, and where they lie on it.
TEST_F(ImportPtex, TrianglesSayWhichFaceTheyBelongTo) {
    const std::string points = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 1 1 0 0 1 0] \"integer indices\" [0 1 2 0 2 3]\n";
    for (const bool with_uvs : {false, true}) {
        const std::string shape = points + "\"integer faceIndices\" [2 1]\n" + (with_uvs ? "\"point2 uv\" [0 0 1 0 1 1 0 1]\n" : "");
        const auto scene = load(scene_with("Material \"diffuse\" \"texture reflectance\" \"paint\"\n", shape));
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        EXPECT_TRUE(scene->warnings.empty()) << scene->warnings[0];
        const auto paint = std::dynamic_pointer_cast<const PtexAtlas>(scene->images.at(0));
        TriangleMesh mesh;
        MeshIssues issues;
        ASSERT_TRUE(scene->shapes.at(0).mesh->load(mesh, issues).ok());
        ASSERT_EQ(mesh.triangles.size(), 2u);
        EXPECT_EQ(mesh.uvs.at(mesh.triangles[0][2]), paint->place(2, 1, 1));
        EXPECT_EQ(mesh.uvs.at(mesh.triangles[1][1]), with_uvs ? paint->place(1, 1, 1) : paint->place(1, 1, 0));
        EXPECT_EQ(mesh.uvs.at(mesh.triangles[1][2]), with_uvs ? paint->place(1, 0, 1) : paint->place(1, 1, 1));
    }
}

TEST_F(ImportPtex, WhatCannotBeShownIsSaid) {
    const auto warning = [&](const std::string& text) {
        const auto scene = load(text);
        if (!scene) return scene.status().message();
        return scene->warnings.empty() ? std::string() : scene->warnings[0];
    };
    const std::string paint = "Material \"diffuse\" \"texture reflectance\" \"paint\"\n";
    EXPECT_EQ(warning(scene_with(paint)), "");
    EXPECT_NE(warning(scene_with(paint, "Shape \"sphere\"\n")).find("on PLY meshes and on triangle meshes"), std::string::npos);
    const std::string both =
        "Texture \"other\" \"spectrum\" \"ptex\" \"string filename\" \"other.ptx\"\n"
        "Texture \"both\" \"spectrum\" \"scale\" \"texture tex\" \"paint\" \"texture scale\" \"wear\"\n"
        "Texture \"odd\" \"spectrum\" \"mix\" \"texture tex1\" \"paint\" \"texture tex2\" \"other\"\n";
    EXPECT_EQ(warning(scene_with(both + "Material \"diffuse\" \"texture reflectance\" \"both\"\n")), "");
    EXPECT_NE(warning(scene_with(both + "Material \"diffuse\" \"texture reflectance\" \"odd\"\n")).find("of other faces"), std::string::npos);
    folder_.write("wear.ptx", "Ptex");
    EXPECT_EQ(warning(scene_with(paint)), "") << "what is not used may be damaged";
    EXPECT_NE(warning(scene_with("Material \"diffuse\" \"texture reflectance\" \"paint\" \"texture displacement\" \"wear\"\n")).find("wear.ptx: "),
              std::string::npos);
}

// As MeshLab writes them. Vertices are split where corners differ, and only there.
TEST(ImportCornerUvs, OfPlyFacesAreRead) {
    const TemporaryFolder folder;
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    folder.write("mesh.ply", head + "3 0 1 2 6 0 0 0.5 0 0.5 1\n3 0 2 3 6 0 0 0.75 1 0 1\n");
    folder.write("a.pgm", "P5 1 1 255\n\x80");
    const auto scene =
        import_scene({folder.write("a.pbrt",
                                   "WorldBegin\nLightSource \"point\"\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.pgm\"\n"
                                   "Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"plymesh\" \"string filename\" \"mesh.ply\"\n")});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    TriangleMesh mesh;
    MeshIssues issues;
    ASSERT_TRUE(scene->shapes[0].mesh->load(mesh, issues).ok());
    EXPECT_TRUE(issues.warnings.empty());
    ASSERT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.positions.size(), 5u) << "one corner differs";
    const auto uv = [&](size_t t, size_t k) { return mesh.uvs.at(mesh.triangles[t][k]); };
    EXPECT_EQ(uv(0, 1), (Float2{0.5f, 0}));
    EXPECT_EQ(uv(0, 2), (Float2{0.5f, 1}));
    EXPECT_EQ(uv(1, 1), (Float2{0.75f, 1}));
    EXPECT_EQ(uv(1, 2), (Float2{0, 1}));
    EXPECT_EQ(mesh.triangles[0][0], mesh.triangles[1][0]);
}

}  // namespace
}  // namespace raypager
