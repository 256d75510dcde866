// Colours of vertices and faces, in all formats that have them.
#include <gtest/gtest.h>

#include "unit/import_files.hpp"
#include "unit/import_load.hpp"

namespace raypager {
namespace {

using test::bytes_of;
using test::expect_warning;
using test::load_text;
using test::Loaded;
using Colors = std::vector<uint32_t>;

constexpr uint32_t red = 0x0000ff, green = 0x00ff00, blue = 0xff0000, grey = 0xc8c8c8;
const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(ImportMeshColors, ObjVertices) {
    // x y z r g b; with a weight before and with alpha behind; of whole numbers; and some without any.
    for (const char* vertices : {"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\n", "v 0 0 0 1 1 0 0\nv 1 0 0 1 0 1 0\nv 0 1 0 1 0 0 1\n",
                                 "v 0 0 0 1 0 0 1\nv 1 0 0 0 1 0 1\nv 0 1 0 0 0 1 1\n", "v 0 0 0 255 0 0\nv 1 0 0 0 255 0\nv 0 1 0 0 0 255\n",
                                 "v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ffff0000ff00ff00ff0000ff\n"}) {
        const Loaded loaded = load_text("a.obj", std::string(vertices) + "f 1 2 3\n");
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        EXPECT_EQ(loaded.mesh.colors, (Colors{red, green, blue})) << vertices;
    }
    EXPECT_EQ(load_text("a.obj", "v 0 0 0\nv 1 0 0 0 1 0\nv 0 1 0\nf 1 2 3\n").mesh.colors, (Colors{grey, green, grey}));
    EXPECT_TRUE(load_text("a.obj", square + "f 1 2 3\n").mesh.colors.empty());
    EXPECT_TRUE(load_text("a.obj", "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n").mesh.colors.empty());
    // Vertices that are split for their normals take their colours along.
    const Loaded split = load_text("a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 2//2 3//2\n");
    EXPECT_EQ(split.mesh.colors, (Colors{red, green, blue, red, green, blue}));
    EXPECT_EQ(split.mesh.normals.size(), 6u);
}

std::string ply(const std::string& vertex, const std::string& face, const std::string& encoding, const std::string& data) {
    return "ply\nformat " + encoding + " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" + vertex +
           "element face 1\nproperty list uchar int vertex_indices\n" + face + "end_header\n" + data;
}

TEST(ImportMeshColors, PlyVertices) {
    const auto three = [](const std::string& type, const std::string& prefix = "") {
        std::string text;
        for (const char* name : {"red", "green", "blue"}) text += "property " + type + " " + prefix + name + "\n";
        return text;
    };
    const std::string bytes = "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n3 0 1 2\n", ones = "0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 0 0 1\n3 0 1 2\n";
    const std::string words = "0 0 0 65535 0 0\n1 0 0 0 65535 0\n0 1 0 0 0 65535\n3 0 1 2\n";
    EXPECT_EQ(load_text("a.ply", ply(three("uchar"), "", "ascii", bytes)).mesh.colors, (Colors{red, green, blue}));
    EXPECT_EQ(load_text("a.ply", ply(three("uchar", "diffuse_"), "", "ascii", bytes)).mesh.colors, (Colors{red, green, blue}));
    EXPECT_EQ(load_text("a.ply", ply(three("float"), "", "ascii", ones)).mesh.colors, (Colors{red, green, blue}));
    EXPECT_EQ(load_text("a.ply", ply(three("float"), "", "ascii", bytes)).mesh.colors, (Colors{red, green, blue}));
    EXPECT_EQ(load_text("a.ply", ply(three("ushort"), "", "ascii", words)).mesh.colors, (Colors{red, green, blue}));
    EXPECT_EQ(load_text("a.ply", ply(three("ushort"), "", "ascii", bytes)).mesh.colors, (Colors{red, green, blue}));
    EXPECT_EQ(load_text("a.ply", ply("property uchar r\nproperty uchar g\nproperty uchar b\n", "", "ascii", bytes)).mesh.colors,
              (Colors{red, green, blue}));
    for (const bool big : {false, true}) {
        const std::string encoding = big ? "binary_big_endian" : "binary_little_endian";
        std::string data_of_bytes, data_of_words;
        for (int i = 0; i < 3; ++i) {
            for (const float c : {i == 1 ? 1.0f : 0.0f, i == 2 ? 1.0f : 0.0f, 0.0f}) {
                data_of_bytes += bytes_of(c, big);
                data_of_words += bytes_of(c, big);
            }
            for (int c = 0; c < 3; ++c) {
                data_of_bytes += bytes_of<uint8_t>(c == i ? 255 : 0);
                data_of_words += bytes_of<uint16_t>(c == i ? 65535 : 0, big);
            }
        }
        std::string face = "\3";
        for (const int i : {0, 1, 2}) face += bytes_of(i, big);
        EXPECT_EQ(load_text("a.ply", ply(three("uchar"), "", encoding, data_of_bytes + face)).mesh.colors, (Colors{red, green, blue}));
        EXPECT_EQ(load_text("a.ply", ply(three("ushort"), "", encoding, data_of_words + face)).mesh.colors, (Colors{red, green, blue}));
    }
}

// Two triangles that share an edge: where colours differ, its vertices are there twice.
TEST(ImportMeshColors, PlyFacesAndWedges) {
    const std::string start =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
        "property list uchar int vertex_indices\n";
    const std::string vertices = "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    const std::string colors = "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
    const Loaded two = load_text("a.ply", start + colors + vertices + "3 0 1 2 255 0 0 255\n3 0 2 3 0 255 0 255\n");
    ASSERT_TRUE(two.status.ok()) << two.status.message();
    ASSERT_EQ(two.mesh.colors.size(), 6u);
    for (size_t t = 0; t < 2; ++t)
        for (const uint32_t v : two.mesh.triangles[t]) EXPECT_EQ(two.mesh.colors[v], t == 0 ? red : green);
    const Loaded one = load_text("a.ply", start + colors + vertices + "3 0 1 2 255 0 0 255\n3 0 2 3 255 0 0 255\n");
    EXPECT_EQ(one.mesh.colors, (Colors{red, red, red, red}));
    const Loaded wedges = load_text("a.ply", start + "property list uchar float texcoord\nproperty list uchar float color\n" + vertices +
                                                 "3 0 1 2 6 0 0 0 0 0 0 9 1 0 0 0 1 0 0 0 1\n3 0 2 3 6 0 0 0 0 0 0 9 1 0 0 0 0 1 0 1 0\n");
    ASSERT_TRUE(wedges.status.ok()) << wedges.status.message();
    EXPECT_EQ(wedges.mesh.colors, (Colors{red, green, blue, green}));
    EXPECT_EQ(wedges.mesh.uvs.size(), 4u);
    // In types wider than a byte, colours may be those of bytes all the same.
    for (const char* type : {"ushort", "int", "float"}) {
        const std::string t = type;
        const Loaded wide = load_text("a.ply", start + "property " + t + " red\nproperty " + t + " green\nproperty " + t + " blue\n" + vertices +
                                                   "3 0 1 2 255 0 0\n3 0 2 3 1 0 0\n");
        ASSERT_TRUE(wide.status.ok()) << wide.status.message();
        for (size_t i = 0; i < 2; ++i)
            for (const uint32_t v : wide.mesh.triangles[i]) EXPECT_EQ(wide.mesh.colors[v], i == 0 ? red : 1u) << type;
    }
}

TEST(ImportMeshColors, OffVerticesAndFaces) {
    const std::string faces = "3 0 1 2\n3 0 2 3\n";
    const std::string colored = "0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n1 1 0 0 0 255 255\n0 1 0 255 0 0 255\n";
    const std::string plain = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    EXPECT_EQ(load_text("a.off", "COFF\n4 2 0\n" + colored + faces).mesh.colors, (Colors{red, green, blue, red}));
    EXPECT_EQ(load_text("a.off", "OFF\n4 2 0\n" + colored + faces).mesh.colors, (Colors{red, green, blue, red}));
    for (const char* data : {"3 0 1 2 255 0 0\n3 0 2 3 0 255 0\n", "3 0 1 2 1.0 0 0\n3 0 2 3 0 1.0 0\n", "3 0 1 2 1 0 0 1\n3 0 2 3 0 1 0 1\n"}) {
        const Loaded loaded = load_text("a.off", "OFF\n4 2 0\n" + plain + data);
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        ASSERT_EQ(loaded.mesh.colors.size(), 6u);
        for (size_t t = 0; t < 2; ++t)
            for (const uint32_t v : loaded.mesh.triangles[t]) EXPECT_EQ(loaded.mesh.colors[v], t == 0 ? red : green) << data;
    }
    const Loaded map = load_text("a.off", "OFF\n4 2 0\n" + plain + "3 0 1 2 7\n3 0 2 3 1\n");
    expect_warning(map, "colours of 2 faces are numbers in a colour map");
    EXPECT_TRUE(map.mesh.colors.empty());
}

TEST(ImportMeshColors, BinaryStl) {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    std::string content = test::to_stl_binary(mesh);
    EXPECT_TRUE(load_text("a.stl", content).mesh.colors.empty());
    const auto set = [&](size_t triangle, uint16_t attributes) { content.replace(84 + 50 * triangle + 48, 2, bytes_of(attributes)); };
    set(0, 0x8000 | 31 << 10);  // VisCAM: red
    set(1, 0);
    const Loaded viscam = load_text("a.stl", content);
    ASSERT_EQ(viscam.mesh.colors.size(), 6u);
    for (size_t t = 0; t < 2; ++t)
        for (const uint32_t v : viscam.mesh.triangles[t]) EXPECT_EQ(viscam.mesh.colors[v], t == 0 ? red : grey);
    // Materialise: a colour for all in the header, and the other way around in triangles.
    content.replace(10, 10, std::string("COLOR=") + "\x00\xff\x00\xff"[1] + std::string("\x00\x00\xff", 3));
    set(0, 31);      // red
    set(1, 0x8000);  // as the header says: red too
    EXPECT_EQ(load_text("a.stl", content).mesh.colors, (Colors{red, red, red, red}));
    set(0, 31 << 5);
    const Loaded materialise = load_text("a.stl", content);
    for (size_t t = 0; t < 2; ++t)
        for (const uint32_t v : materialise.mesh.triangles[t]) EXPECT_EQ(materialise.mesh.colors[v], t == 0 ? green : red);
}

}  // namespace
}  // namespace raypager
