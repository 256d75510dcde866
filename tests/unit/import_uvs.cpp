// Coordinates of textures, in all formats that have them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "import/obj_file.hpp"
#include "scene/texture_use.hpp"
#include "unit/import_files.hpp"
#include "unit/import_load.hpp"
#include "unit/pbrt_fixture.hpp"

namespace raypager {
namespace {

using test::bytes_of;
using test::load_text;
using test::Loaded;
using Uvs = std::vector<Float2>;

// u and v of the corners of all triangles, whatever the vertex numbers.
Uvs uvs_of_corners(const TriangleMesh& mesh) {
    Uvs result;
    for (const Triangle& t : mesh.triangles)
        for (const uint32_t v : t) result.push_back(mesh.uvs.empty() ? Float2{NAN, NAN} : mesh.uvs[v]);
    return result;
}

std::string ply_with_uvs(const std::string& vertex, const std::string& face, const std::string& encoding, const std::string& data) {
    return "ply\nformat " + encoding + " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" + vertex +
           "element face 1\nproperty list uchar int vertex_indices\n" + face + "end_header\n" + data;
}

// Takes a mesh as a bake does, and says whether coordinates are wanted.
class CollectingSink final : public MeshSink {
public:
    explicit CollectingSink(bool wanted) : wanted_(wanted) {}
    bool wants_uvs() const override { return wanted_; }
    Status vertices(const MeshVertices& vertices) override {
        positions += vertices.positions.size();
        uvs.insert(uvs.end(), vertices.uvs.begin(), vertices.uvs.end());
        return {};
    }
    Status triangles(std::span<const Triangle>) override { return {}; }
    size_t positions = 0;
    Uvs uvs;

private:
    bool wanted_;
};

CollectingSink stream_text(const std::string& name, const std::string& content, bool wanted, MeshIssues& issues) {
    const support::TemporaryFolder folder;
    const auto file = MeshFile::open(folder.write(name, content));
    if (!file) throw std::runtime_error(file.status().message());
    CollectingSink sink(wanted);
    const Status status = (*file)->stream(sink, issues);
    if (!status.ok()) throw std::runtime_error(status.message());
    return sink;
}

TEST(ImportUvs, PlyVertices) {
    const Uvs expected = {{0, 0.25f}, {1, 0.5f}, {0.75f, 2}};
    const std::string text = "0 0 0 0 0.25\n1 0 0 1 0.5\n0 1 0 0.75 2\n3 0 1 2\n";
    for (const auto& [u, v] :
         {std::pair("u", "v"), {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}, {"texcoord_u", "texcoord_v"}}) {
        const std::string both = std::string("property float ") + u + "\nproperty double " + v + "\n";
        EXPECT_EQ(load_text("a.ply", ply_with_uvs(both, "", "ascii", text)).mesh.uvs, expected) << u;
        for (const bool big : {false, true}) {
            std::string data;
            for (const auto& [x, y, s, t] : {std::array{0.f, 0.f, 0.f, 0.25f}, {1, 0, 1, 0.5f}, {0, 1, 0.75f, 2}}) {
                for (const float c : {x, y, 0.f, s}) data += bytes_of(c, big);
                data += bytes_of(double(t), big);
            }
            data += '\3' + bytes_of(0, big) + bytes_of(1, big) + bytes_of(2, big);
            const std::string file = ply_with_uvs(both, "", big ? "binary_big_endian" : "binary_little_endian", data);
            EXPECT_EQ(load_text("a.ply", file).mesh.uvs, expected) << u;
            MeshIssues issues;
            EXPECT_EQ(stream_text("a.ply", file, true, issues).uvs, expected);
            EXPECT_TRUE(stream_text("a.ply", file, false, issues).uvs.empty());
            EXPECT_TRUE(issues.warnings.empty());
        }
    }
    EXPECT_TRUE(load_text("a.ply", ply_with_uvs("property float u\n", "", "ascii", "0 0 0 0\n1 0 0 1\n0 1 0 1\n3 0 1 2\n")).mesh.uvs.empty());
}

// As MeshLab writes them. They count where they are wanted and vertices have none.
TEST(ImportUvs, PlyCorners) {
    const std::string file = ply_with_uvs("", "property list uchar float texcoord\n", "ascii", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1\n");
    MeshIssues issues;
    EXPECT_EQ(stream_text("a.ply", file, true, issues).uvs, (Uvs{{0, 0}, {1, 0}, {0, 1}}));
    EXPECT_TRUE(stream_text("a.ply", file, false, issues).uvs.empty()) << "nobody would look at them";
    EXPECT_TRUE(issues.warnings.empty());
    const std::string both = ply_with_uvs("property float u\nproperty float v\n", "property list uchar float texcoord\n", "ascii",
                                          "0 0 0 5 6\n1 0 0 5 6\n0 1 0 5 7\n3 0 1 2 6 0 0 1 0 0 1\n");
    EXPECT_EQ(stream_text("a.ply", both, true, issues).uvs, (Uvs{{5, 6}, {5, 6}, {5, 7}}));
}

// Vertices that share a position but not their coordinates are split; those that agree are not.
TEST(ImportUvs, ObjCorners) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 1 1 0.5\nvt 5\n";
    const Loaded same = load_text("a.obj", square + "f 1/1 2/2 3/3\nf 1/1 3/5 4/4\n");
    ASSERT_TRUE(same.status.ok()) << same.status.message();
    EXPECT_EQ(same.mesh.positions.size(), 4u);
    EXPECT_EQ(uvs_of_corners(same.mesh), (Uvs{{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}));
    EXPECT_TRUE(same.mesh.normals.empty());
    const Loaded split = load_text("a.obj", square + "f 1/1 2/2 3/3\nf 1/1 3/6 4/-3\n");
    EXPECT_EQ(split.mesh.positions.size(), 5u);
    EXPECT_EQ(uvs_of_corners(split.mesh), (Uvs{{0, 0}, {1, 0}, {1, 1}, {0, 0}, {5, 0}, {0, 1}}));
    // Positions and normals go along.
    const Loaded both = load_text("a.obj", square + "vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1/1/2 3/3/1 4/4/1\nf 2/2 3/3 4/4\n");
    ASSERT_TRUE(both.status.ok()) << both.status.message();
    ASSERT_EQ(both.mesh.normals.size(), both.mesh.positions.size());
    EXPECT_EQ(uvs_of_corners(both.mesh), (Uvs{{0, 0}, {0, 0}, {0, 0}, {0, 0}, {1, 1}, {0, 1}, {1, 0}, {1, 1}, {0, 1}}));
    EXPECT_EQ(test::corners(both.mesh)[1][1], (Float3{1, 1, 0}));
    const auto normal = [&](size_t t, size_t k) { return both.mesh.normals[both.mesh.triangles[t][k]]; };
    EXPECT_EQ(normal(0, 0), (Float3{0, 0, 1}));
    EXPECT_EQ(normal(1, 0), (Float3{0, 1, 0}));
    EXPECT_EQ(normal(1, 1), (Float3{0, 0, 1}));
}

TEST(ImportUvs, ObjWithoutUseOfThemIsAsIfItHadNone) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    MeshIssues issues;
    const std::string file = square + "f 1/1/1 2/2/1 3/3/1\nf 1/4/1 3/3/1 4/4/1\n";
    EXPECT_EQ(stream_text("a.obj", file, false, issues).positions, 4u);
    EXPECT_EQ(stream_text("a.obj", file, true, issues).positions, 5u);
    // No library of the scene has an image.
    const support::TemporaryFolder folder;
    folder.write("m.mtl", "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n");
    const auto plain = ObjFile::open(folder.write("a.obj", "mtllib m.mtl\n" + file));
    ASSERT_TRUE(plain.ok());
    EXPECT_TRUE((*(*plain)->model())->mesh.uvs.empty());
    EXPECT_EQ((*(*plain)->model())->mesh.positions.size(), 4u);
    folder.write("a.pgm", "P5 1 1 255 x");
    folder.write("t.mtl", "newmtl a\nmap_Kd a.pgm\n");
    const auto textured = ObjFile::open(folder.write("b.obj", "mtllib t.mtl\nusemtl b\n" + file + "usemtl a\nf 2/2 3/1 4/4\n"));
    ASSERT_TRUE(textured.ok());
    const auto model = (*textured)->model();
    ASSERT_TRUE(model.ok());
    EXPECT_EQ((*model)->mesh.uvs.size(), (*model)->mesh.positions.size());
    EXPECT_EQ(uvs_of_corners(part_of_obj(**model, 1, 0)), (Uvs{{1, 0}, {0, 0}, {0, 1}}));
}

TEST(ImportUvs, WhatIsNotFiniteBecomesZero) {
    const Loaded loaded = load_text("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 1\nvt what 1\nvt 1e30 1\nf 1/1 2/2 3/3\n");
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    EXPECT_EQ(loaded.mesh.uvs, (Uvs{{0, 0}, {0, 0}, {0, 0}}));
    EXPECT_EQ(loaded.issues.bad_uv, 3u);
    EXPECT_NE(loaded.issues.describe().find("3 vertices with coordinates of textures"), std::string::npos) << loaded.issues.describe();
}

TEST(ImportUvs, OffVertices) {
    const Uvs expected = {{0, 0.25f}, {1, 0.5f}, {0.75f, 2}};
    EXPECT_EQ(load_text("a.off", "STOFF\n3 1 0\n0 0 0 0 0.25\n1 0 0 1 0.5\n0 1 0 0.75 2\n3 0 1 2\n").mesh.uvs, expected);
    const Loaded all = load_text("a.off",
                                 "STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 0 255 0 0.25\n1 0 0 0 0 1 255 0 0 255 1 0.5\n"
                                 "0 1 0 0 0 1 255 0 0 255 0.75 2\n3 0 1 2\n");
    EXPECT_EQ(all.mesh.uvs, expected);
    EXPECT_EQ(all.mesh.colors.size(), 3u);
    EXPECT_EQ(all.mesh.normals.size(), 3u);
    // Wherever the lines end.
    EXPECT_EQ(load_text("a.off", "STOFF\n3 1 0 0 0 0 0\n0.25 1 0 0 1 0.5 0 1 0 0.75 2 3 0 1 2\n").mesh.uvs, expected);
    EXPECT_TRUE(load_text("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").mesh.uvs.empty());
}

// The materials of bare meshes, libraries of OBJ apart, read no textures.
TEST(ImportUvs, BareMeshesAreReadWithoutThem) {
    const support::TemporaryFolder folder;
    const auto path = folder.write("a.off", "STOFF\n3 1 0\n0 0 0 0 0.25\n1 0 0 1 0.5\n0 1 0 nan 2\n3 0 1 2\n");
    const auto file = MeshFile::open(path);
    ASSERT_TRUE(file.ok());
    TriangleMesh mesh;
    MeshIssues issues;
    ASSERT_TRUE((*file)->load(mesh, issues, false).ok());
    EXPECT_TRUE(mesh.uvs.empty());
    EXPECT_EQ(issues.bad_uv, 0u);
}

TEST(ImportUvs, StlHasNone) { EXPECT_TRUE(load_text("a.stl", test::to_stl_text(test::make_box())).mesh.uvs.empty()); }

class PbrtUvs : public test::PbrtTest {
protected:
    TriangleMesh mesh(const std::string& shape) {
        const Scene s = expect_silence("WorldBegin\n" + shape + "\n");
        TriangleMesh mesh;
        MeshIssues issues;
        if (s.shapes.empty() || !s.shapes[0].mesh || !s.shapes[0].mesh->load(mesh, issues).ok()) ADD_FAILURE() << "no mesh";
        return mesh;
    }
};

TEST_F(PbrtUvs, TriangleMeshes) {
    const std::string points = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] ";
    for (const char* uvs : {"\"point2 uv\" [0 0.25 1 0.5 0.75 2]", "\"float uv\" [0 0.25 1 0.5 0.75 2]", "\"float st\" [0 0.25 1 0.5 0.75 2]"})
        EXPECT_EQ(mesh(points + uvs).uvs, (Uvs{{0, 0.25f}, {1, 0.5f}, {0.75f, 2}})) << uvs;
    EXPECT_TRUE(mesh(points).uvs.empty());
    expect_warning("WorldBegin\n" + points + "\"point2 uv\" [0 0 1 1]\n", "pairs of uv");
}

TEST_F(PbrtUvs, PatchesAndSubdivisionSurfaces) {
    const std::string points = "\"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"point2 uv\" [0 0 2 0 0 2 2 2] ";
    EXPECT_EQ(mesh("Shape \"bilinearmesh\" " + points).uvs, (Uvs{{0, 0}, {2, 0}, {0, 2}, {2, 2}}));
    const TriangleMesh loop = mesh("Shape \"loopsubdiv\" \"integer levels\" 1 \"integer indices\" [0 1 3 0 3 2] " + points);
    ASSERT_EQ(loop.uvs.size(), loop.positions.size());
    EXPECT_EQ(loop.uvs[4], (Float2{1, 0}));
}

// Shapes that are always round have coordinates where their material reads textures, and else take no room for them.
TEST_F(PbrtUvs, RoundShapesHaveThemWhereTheyAreOfUse) {
    const std::string textured = "WorldBegin\nTexture \"t\" \"spectrum\" \"checkerboard\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n";
    for (const char* shape : {"disk", "cylinder", "cone", "paraboloid", "hyperboloid", "sphere", "bilinearmesh"}) {
        // What one of them asks for is nothing to the others.
        const std::string text = std::string("Shape \"") + shape + "\" \"float zmin\" 0 \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]";
        for (const bool reads : {false, true}) {
            const Scene s = scene((reads ? textured : "WorldBegin\n") + text + "\n");
            ASSERT_EQ(s.shapes.size(), 1u) << text;
            TriangleMesh found;
            MeshIssues issues;
            ASSERT_TRUE(s.shapes[0].mesh->load(found, issues).ok());
            EXPECT_EQ(found.uvs.size(), uses_uvs(s, s.shapes[0].material) ? found.positions.size() : 0u) << text;
        }
    }
}

}  // namespace
}  // namespace raypager
