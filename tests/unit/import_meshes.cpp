// Readers of mesh files: what they make of sound files, odd ones, and each other's formats.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include "base/parallel.hpp"
#include "import/mesh_file.hpp"
#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/import_files.hpp"
#include "unit/import_load.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;
using test::bytes_of;
using test::corners;
using test::expect_error;
using test::expect_warning;
using test::load;
using test::load_text;
using test::Loaded;
using test::make_box;

struct Format {
    const char* file;
    std::function<std::string(const TriangleMesh&)> write;
};

const std::vector<Format> formats = {
    {"a.ply", [](const TriangleMesh& m) { return test::to_ply_binary(m); }},
    {"b.PLY", [](const TriangleMesh& m) { return test::to_ply_binary(m, true); }},
    {"c.ply", test::to_ply_text},
    {"d.obj", test::to_obj},
    {"e.off", test::to_off},
    {"f.stl", test::to_stl_text},
    {"g.stl", test::to_stl_binary},
};

TEST(ImportMeshes, EveryFormatGivesTheSameTriangles) {
    TriangleMesh box = make_box(0.1f, 1.0f / 3, 16777215.0f);  // numbers that are easily rounded
    box.positions[0] = {-1.17549449e-7f, -3.40000011e-3f, 8388607.5f};
    for (const Format& format : formats) {
        SCOPED_TRACE(format.file);
        const Loaded loaded = load_text(format.file, format.write(box));
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        EXPECT_TRUE(corners(loaded.mesh) == corners(box));
        EXPECT_FALSE(loaded.issues.any()) << loaded.issues.describe();
        EXPECT_EQ(loaded.mesh.positions.size(), 8u);
    }
}

TEST(ImportMeshes, BinaryPlyOfAnyLayout) {
    const auto content = [](bool big) {
        std::string text = std::string("ply\r\nformat ") + (big ? "binary_big_endian" : "binary_little_endian") + " 1.0\r\n";
        text += "element extra 2\r\nproperty list ushort double weights\r\nproperty char tag\r\n";
        text += "element vertex 5\r\nproperty uchar red\r\nproperty double z\r\nproperty short nx\r\nproperty float x\r\nproperty int y\r\n";
        text += "property float ny\r\nproperty float nz\r\nelement face 2\r\nproperty uchar flags\r\nproperty list int ushort vertex_index\r\n";
        text += "property list uchar float texcoord\r\nend_header\r\n";
        for (int i = 0; i < 2; ++i) {
            text += bytes_of<uint16_t>(static_cast<uint16_t>(i), big) + (i ? bytes_of(1.5, big) : "") + "t";
        }
        for (int i = 0; i < 5; ++i)
            text += bytes_of<uint8_t>(9) + bytes_of(i * 0.5, big) + bytes_of<int16_t>(static_cast<int16_t>(i), big) + bytes_of(float(i * i), big) +
                    bytes_of<int32_t>(-i, big) + bytes_of(2.5f, big) + bytes_of(-1.0f, big);
        text += "f" + bytes_of<int32_t>(3, big);
        for (const uint16_t i : {0, 1, 2}) text += bytes_of(i, big);
        text += bytes_of<uint8_t>(1) + bytes_of(0.5f, big) + "f" + bytes_of<int32_t>(5, big);
        for (const uint16_t i : {4, 3, 2, 1, 0}) text += bytes_of(i, big);
        return text + bytes_of<uint8_t>(0);
    };
    for (const bool big : {false, true}) {
        SCOPED_TRACE(big);
        const Loaded loaded = load_text("a.ply", content(big));
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {4, 3, 2}, {4, 2, 1}, {4, 1, 0}}));
        EXPECT_EQ(loaded.mesh.positions[3], (Float3{9, -3, 1.5f}));
        ASSERT_EQ(loaded.mesh.normals.size(), 5u);
        EXPECT_EQ(loaded.mesh.normals[3], (Float3{3, 2.5f, -1}));
    }
}

TEST(ImportMeshes, BinaryPlyLargerThanOnePiece) {
    TriangleMesh mesh;  // about 9 MB, read in pieces of 4 MiB
    constexpr uint32_t side = 500;
    for (uint32_t i = 0; i < side * side; ++i) mesh.positions.push_back({float(i % side), float(i / side), float(i % 7)});
    for (uint32_t y = 0; y + 1 < side; ++y)
        for (uint32_t x = 0; x + 1 < side; ++x) {
            const uint32_t i = y * side + x;
            mesh.triangles.push_back({i, i + 1, i + side});
            mesh.triangles.push_back({i + 1, i + side + 1, i + side});
        }
    const Loaded loaded = load_text("a.ply", test::to_ply_binary(mesh));
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    EXPECT_EQ(loaded.mesh.positions, mesh.positions);
    EXPECT_EQ(loaded.mesh.triangles, mesh.triangles);
}

// By all cores.
TEST(ImportMeshes, ManyBinaryVerticesWithNormals) {
    constexpr uint32_t vertices = 700000;
    for (const bool big : {false, true}) {
        SCOPED_TRACE(big);
        std::string text = fmt::format("ply\nformat binary_{}_endian 1.0\nelement vertex {}\nproperty short x\nproperty char nx\nproperty double y\n",
                                       big ? "big" : "little", vertices);
        text += "property uchar ny\nproperty char nz\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        for (uint32_t i = 0; i < vertices; i++)
            text += bytes_of(static_cast<int16_t>(i % 30011), big) + bytes_of(static_cast<int8_t>(i % 120)) + bytes_of(double(i), big) +
                    bytes_of(static_cast<uint8_t>(i % 250)) + bytes_of(static_cast<int8_t>(1)) + bytes_of(float(i % 77), big);
        text += bytes_of(static_cast<uint8_t>(3));
        for (const int32_t v : {0, 1, 2}) text += bytes_of(v, big);
        const Loaded loaded = load_text("a.ply", text);
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        ASSERT_EQ(loaded.mesh.positions.size(), vertices);
        ASSERT_EQ(loaded.mesh.normals.size(), vertices);
        for (uint32_t i = 0; i < vertices; i++) {
            ASSERT_EQ(loaded.mesh.positions[i], (Float3{float(i % 30011), float(i), float(i % 77)})) << i;
            ASSERT_EQ(loaded.mesh.normals[i], (Float3{float(i % 120), float(i % 250), 1})) << i;
        }
    }
}

// Triangles are read many at a time by all cores, up to the next face that is none.
TEST(ImportMeshes, BinaryPlyOfTrianglesAndPolygons) {
    constexpr uint32_t faces = 700000, vertices = 1000;
    const std::set<uint32_t> polygons = {0, 1, 80000, 87381, 100000, 100001, 699999};
    for (const bool big : {false, true}) {
        SCOPED_TRACE(big);
        std::string text = fmt::format("ply\nformat binary_{}_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
                                       big ? "big" : "little", vertices);
        text += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", faces);
        for (uint32_t i = 0; i < vertices; i++)
            text += bytes_of(float(i * i % 101), big) + bytes_of(float(i), big) + bytes_of(float(i * i % 97), big);
        std::vector<Triangle> expected;
        for (uint32_t i = 0; i < faces; i++) {
            const uint32_t corners = polygons.contains(i) ? 5 : 3, first = i % (vertices - 4);
            text += bytes_of(static_cast<uint8_t>(corners));
            for (uint32_t k = 0; k < corners; k++) text += bytes_of(static_cast<int32_t>(first + k), big);
            for (uint32_t k = 2; k < corners; k++) expected.push_back({first, first + k - 1, first + k});
        }
        const TemporaryFolder folder;
        const auto path = folder.write("a.ply", text);
        for (const bool alone : {false, true}) {
            std::optional<WorkersAtMost> one_thread;
            if (alone) one_thread.emplace(1);
            const Loaded loaded = load(path);
            ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
            EXPECT_TRUE(loaded.mesh.triangles == expected);
        }
        expect_error(load_text("b.ply", text.substr(0, text.size() - 1)), "truncated");
    }
}

TEST(ImportMeshes, PlyErrorsNameTheCause) {
    const std::string good = test::to_ply_binary(make_box());
    const auto replaced = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        return text.replace(text.find(from), from.size(), to);
    };
    expect_error(load_text("a.ply", replaced("vertex 8", "vertex 4000000000")), "promises 4000000000");
    expect_error(load_text("a.ply", replaced("vertex 8", "vertex 99999999999999999999")), "no count");
    expect_error(load_text("a.ply", replaced("face 12", "face 13")), "truncated");
    expect_warning(load_text("a.ply", replaced("face 12", "face 11")), "13 bytes follow the last element");
    expect_error(load_text("a.ply", replaced("property float z", "property float w")), "lack x, y or z");
    expect_error(load_text("a.ply", replaced("element face 12\nproperty list uchar int vertex_indices\n", "")), "point cloud");
    expect_error(load_text("a.ply", replaced("ply\n", "plx\n")), "not a PLY file");
    expect_error(load_text("a.ply", replaced("list uchar", "list float")), "must be an integer");
    expect_error(load_text("a.ply", good.substr(0, 60)), "within its PLY header");
    expect_error(load_text("a.ply", good.substr(0, good.size() - 1)), "truncated");
}

TEST(ImportMeshes, BadTrianglesAreCountedAndDropped) {
    TriangleMesh mesh = make_box();
    mesh.positions.push_back({0, NAN, 0});
    mesh.positions.push_back({-INFINITY, 0, 0});
    for (const Triangle& t : {Triangle{0, 1, 8}, Triangle{0, 9, 1}, Triangle{0, 1, 10}, Triangle{3, 3, 1}, Triangle{1, 5, 7}})
        mesh.triangles.push_back(t);
    for (const Format& format : formats) {
        SCOPED_TRACE(format.file);
        const bool stl = format.file == std::string("f.stl") || format.file == std::string("g.stl");
        TriangleMesh input = mesh;
        if (stl) input.triangles.erase(input.triangles.begin() + 14);  // there are no indices to be wrong
        const Loaded loaded = load_text(format.file, format.write(input));
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        EXPECT_EQ(loaded.mesh.triangles.size(), 13u);
        EXPECT_EQ(loaded.issues.not_finite, 2u);
        EXPECT_EQ(loaded.issues.bad_index, stl ? 0u : 1u);
        EXPECT_EQ(loaded.issues.degenerate, 1u);
        EXPECT_EQ(loaded.issues.duplicate, 1u);
        EXPECT_GT(loaded.issues.non_manifold_edges, 0u);
    }
}

TEST(ImportMeshes, AMissingOrWrongFileIsAnError) {
    const TemporaryFolder folder;
    expect_error(load(folder / "absent.ply"), "absent.ply: cannot be opened");
    expect_error(load(folder.write("a.xyz", "1 2 3")), "no mesh file");
    expect_error(load(folder.write("a.ply.gz", "1 2 3")), "not a PLY file");
    expect_error(load(folder.write("empty.obj", "")), "empty");
    std::filesystem::create_directory(folder / "folder.stl");
    expect_error(load(folder / "folder.stl"), "regular file");
}

TEST(ImportMeshes, AKeptMeshIsHandedOverOnce) {
    const TemporaryFolder folder;
    const auto path = folder.write("a.ply", test::to_ply_binary(make_box()));
    const auto file = MeshFile::open(path);
    ASSERT_TRUE(file.ok());
    MeshIssues found, issues;
    found.duplicate = 3;
    TriangleMesh mesh = make_box(), loaded;
    mesh.triangles.resize(5);
    (*file)->keep_for_next_load(mesh, found);
    ASSERT_TRUE((*file)->load(loaded, issues).ok());
    EXPECT_EQ(loaded.triangles.size(), 5u);
    EXPECT_EQ(issues.duplicate, 3u);
    ASSERT_TRUE((*file)->load(loaded, issues).ok());
    EXPECT_EQ(loaded.triangles.size(), 12u);
    EXPECT_EQ((*file)->files(), std::vector<std::string>{path.string()});
}

TEST(ImportMeshes, ObjOfAllKinds) {
    const Loaded loaded = load_text("a.obj",
                                    "mtllib /dev/zero\no thing\ng part\nusemtl gold\ns 1\n"
                                    "v 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\n v\t1 1 0 # a comment\nvt 0 0\nv 0 \\\n1 0\n"
                                    "f 1/1 2/1 3/1 4/1\nf -4 -3 -2\nf 4//7 1/1/9 2\nf 1 2 99\nf 0 1 2\nf 2 2 1\nf 1 2\n");
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    EXPECT_EQ(loaded.mesh.positions, (std::vector<Float3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {3, 0, 1}}));
    EXPECT_EQ(loaded.issues.bad_index, 2u);
    EXPECT_EQ(loaded.issues.degenerate, 1u);
    EXPECT_EQ(loaded.issues.few_corners, 1u);
    EXPECT_EQ(loaded.issues.duplicate, 1u);
    EXPECT_TRUE(loaded.issues.warnings.empty());
    EXPECT_TRUE(loaded.mesh.normals.empty());
}

TEST(ImportMeshes, ObjVerticesSplitWhereNormalsDiffer) {
    const Loaded loaded = load_text("a.obj",
                                    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 -1\nvn 0 -1 0\n"
                                    "f 1//1 3//1 2//1\nf 1//2 2//2 4//2\nf 2//2 4//2 1//2\n");
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    const TriangleMesh& mesh = loaded.mesh;
    ASSERT_EQ(mesh.triangles.size(), 3u);
    ASSERT_EQ(mesh.positions.size(), 6u);  // vertices 1 and 2 exist twice
    ASSERT_EQ(mesh.normals.size(), 6u);
    for (size_t t = 0; t < 3; ++t)
        for (const uint32_t v : mesh.triangles[t]) EXPECT_EQ(mesh.normals[v], (t == 0 ? Float3{0, 0, -1} : Float3{0, -1, 0})) << "triangle " << t;
    EXPECT_EQ(mesh.positions[mesh.triangles[1][0]], mesh.positions[mesh.triangles[0][0]]);
    EXPECT_EQ(mesh.triangles[1][0], mesh.triangles[2][2]);  // the copy is shared
}

TEST(ImportMeshes, ObjErrorsNameTheLine) {
    expect_error(load_text("a.obj", "v 0 0 0\nv 1 0\nf 1 2 1\n"), "a.obj:2: too few numbers");
    expect_error(load_text("a.obj", "v 0 0 0\nv 1 0 x\n"), "a.obj:2: \"x\" is no number");
    expect_error(load_text("a.obj", "v 0 0 0\nw 1 0 0\n"), "a.obj:2: \"w\" is no statement");
    expect_error(load_text("a.obj", "v 0 0 0\nv 1 0 0\nl 1 2\np 1\n"), "a.obj:3: \"l\" is no face; 2 such lines are all there is");
    expect_error(load_text("a.obj", "v 0 0 0\nf 1 1/2/3/4 1\n"), "a.obj:2: \"1/2/3/4\" is no corner");
    expect_error(load_text("a.obj", "v 0 0 0\n"), "no faces");
    expect_error(load_text("a.obj", std::string("\x89PNG\r\n\x1a\n\0\0", 10)), "a zero byte");
}

TEST(ImportMeshes, OffWithCommentsColoursAndPolygons) {
    const Loaded loaded =
        load_text("a.off",
                  "# made by hand\nCOFF 5 2 7 # counts\n0 0 0 255 0 0 255\n\n1 0 0 1 1 1 1\n1 1 0 0 0 0 0\n0 1 0 0 0 0 0\n2 2 0 0 0 0 0\n"
                  "4 0 1 2 3 0.5 0.5 0.5\n# in between\n3 1 4 2\n");
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {1, 4, 2}}));
    EXPECT_EQ(loaded.mesh.positions[4], (Float3{2, 2, 0}));
    expect_error(load_text("a.off", "OFF BINARY\n1 1 1\n"), "binary OFF");
    expect_error(load_text("a.off", "4OFF\n1 1 1\n"), "4OFF");
    expect_error(load_text("a.off", "OFF\n3000000000 1 0\n"), "a.off:2: 3000000000 vertices");
    expect_error(load_text("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"), "ends after 2 of 3 vertices");
    expect_error(load_text("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n"), "a.off:6: a face of 4000000000 corners cannot be in");
    expect_warning(load_text("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n"), "after the last face");
}

TEST(ImportMeshes, TextPlyOfAnyLayout) {
    const Loaded loaded =
        load_text("a.ply",
                  "ply\nformat ascii 1.0\nelement camera 1\nproperty float view\nelement vertex 4\nproperty uchar red\n"
                  "property float ny\nproperty double z\nproperty float x\nproperty list uchar int near\nproperty float y\nproperty float nx\n"
                  "property float nz\nelement face 2\nproperty list uchar float uv\nproperty list uchar int vertex_indices\n"
                  "element edge 1\nproperty int a\nend_header\n"
                  "0.5\n1 0 3 1 0 2 0 1\n1 0 3 4 2 7 7 5 0 1\n\n1 nan 3 1 0 7 0 1\n1 0 3 9 0 9 0 1\n"
                  "2 0.1 0.2 4 0 1 2 3\n0 3 0 2 -1\n17\n");
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    EXPECT_EQ(loaded.mesh.positions, (std::vector<Float3>{{1, 2, 3}, {4, 5, 3}, {1, 7, 3}, {9, 9, 3}}));
    EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{1, 3, 0}, {3, 1, 2}}));  // concave at vertex 1
    EXPECT_EQ(loaded.issues.bad_index, 1u);
    EXPECT_EQ(loaded.mesh.normals, (std::vector<Float3>{{0, 0, 1}, {0, 0, 1}, {0, 0, 0}, {0, 0, 1}}));
    const std::string good = test::to_ply_text(make_box());
    expect_error(load_text("a.ply", good.substr(0, good.size() / 2)), "a.ply");
    expect_error(load_text("a.ply", good.substr(0, good.size() - 9)), "ends after 11 of 12 items of \"face\"");
    expect_error(load_text("a.ply", good + "3 0 1 2\n"), "after the last element");
    expect_error(load_text("a.ply", good + "4000000000 0 1 2\n"), "after the last element");
}

TEST(ImportMeshes, StlErrorsNameTheLine) {
    const std::string good = test::to_stl_text(make_box());
    expect_error(load_text("a.stl", good.substr(0, good.size() / 2 + 20)), "a.stl:");
    expect_warning(load_text("a.stl", good.substr(0, good.size() - 14)), "ends without endsolid");
    expect_error(load_text("a.stl", good.substr(0, good.size() - 30)), "expected endloop instead of \"en\"");
    expect_error(load_text("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendfacet\n"),
                 "a.stl:5: expected vertex instead of \"endfacet\"");
    expect_error(load_text("a.stl", "solid nothing\nendsolid\n"), "no triangles");
    const std::string binary = test::to_stl_binary(make_box());
    expect_warning(load_text("a.stl", binary.substr(0, binary.size() - 1)), "12 triangles, which take 684 bytes, but the file has 683; 11 are read");
    expect_error(load_text("a.stl", std::string(84, '\0')), "no triangles");
    expect_error(load_text("a.stl", std::string(84, '\xff')), "4294967295");
    // Some programs start binary files with "solid"; the size tells.
    std::string solid = binary;
    solid.replace(0, 5, "solid");
    EXPECT_TRUE(load_text("a.stl", solid).status.ok());
}

TEST(ImportMeshes, StlKeepsClosePositionsApart) {
    TriangleMesh mesh;
    const float e = std::nextafter(1.0f, 2.0f);
    mesh.positions = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {e, 0, 0}, {0, 2, 0}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 2}};
    for (const auto& content : {test::to_stl_text(mesh), test::to_stl_binary(mesh)}) {
        const Loaded loaded = load_text("a.stl", content);
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        EXPECT_EQ(corners(loaded.mesh), corners(mesh));
        EXPECT_EQ(loaded.mesh.positions.size(), 5u);  // the shared corner is one vertex
    }
}

}  // namespace
}  // namespace raypager
