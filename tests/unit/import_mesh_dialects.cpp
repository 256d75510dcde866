// Mesh files as other programs really write them.
#include <gtest/gtest.h>

#include <cmath>

#include "unit/import_files.hpp"
#include "unit/import_load.hpp"

namespace raypager {
namespace {

using test::bytes_of;
using test::corners;
using test::expect_error;
using test::expect_warning;
using test::load_text;
using test::Loaded;
using test::make_box;
using Triangles = std::vector<Triangle>;

std::string with(std::string text, const std::string& from, const std::string& to) {
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) text.replace(at, from.size(), to);
    return text;
}

// As the file without the oddity is read, and without a warning.
void expect_box(const std::string& name, const std::string& content) {
    const Loaded loaded = load_text(name, content);
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    EXPECT_TRUE(corners(loaded.mesh) == corners(make_box())) << content.substr(0, 80);
    EXPECT_FALSE(loaded.issues.any()) << loaded.issues.describe();
    EXPECT_TRUE(loaded.issues.warnings.empty());
}

TEST(ImportMeshDialects, MarksAndLineEnds) {
    const TriangleMesh box = make_box();
    for (const std::string end : {"\r", "\r\n"})
        for (const std::string mark : {"", "\xef\xbb\xbf"}) {
            expect_box("a.obj", mark + with(test::to_obj(box), "\n", end));
            expect_box("a.off", mark + with(test::to_off(box), "\n", end));
            expect_box("a.stl", mark + with(test::to_stl_text(box), "\n", end));
            expect_box("a.ply", mark + with(test::to_ply_text(box), "\n", end));
        }
    // Only the header of a binary file has lines.
    const std::string binary = test::to_ply_binary(box);
    const size_t data = binary.find("end_header\n") + 11;
    expect_box("a.ply", with(binary.substr(0, data), "\n", "\r") + binary.substr(data));
    expect_box("a.ply", with(binary.substr(0, data), "\n", "\r\n") + binary.substr(data));
    expect_box("a.ply", with(with(binary.substr(0, data), "\n", " \n"), "property ", " property\t ") + binary.substr(data));
}

TEST(ImportMeshDialects, BytesBehindBinaryPly) {
    const std::string good = test::to_ply_binary(make_box());
    expect_box("a.ply", good + "\n");
    expect_box("a.ply", good + "\r\n");
    expect_warning(load_text("a.ply", good + std::string(24, 'x')), "24 bytes follow the last element");
    expect_warning(load_text("a.ply", good + "x"), "1 byte follows the last element");
}

TEST(ImportMeshDialects, PlyFacesFirst) {
    const std::string text = test::to_ply_text(make_box());
    const size_t vertex = text.find("element vertex"), face = text.find("element face"), end = text.find("end_header\n");
    size_t split = end + 11;
    for (int i = 0; i < 8; ++i) split = text.find('\n', split) + 1;
    expect_box("a.ply", text.substr(0, vertex) + text.substr(face, end - face) + text.substr(vertex, face - vertex) + "end_header\n" +
                            text.substr(split) + text.substr(end + 11, split - end - 11));
}

TEST(ImportMeshDialects, PlyItemsOverSeveralLines) {
    const std::string text = test::to_ply_text(make_box());
    const size_t data = text.find("end_header\n") + 11;
    expect_box("a.ply", text.substr(0, data) + with(text.substr(data), " ", "\n"));
    expect_box("a.ply", text.substr(0, data) + with(text.substr(data), "\n", " "));
    // A number that is missing is told by its line, however the rest could be read.
    expect_error(load_text("a.ply", with(text, "3 0 3 1\n", "3 0 3\n")), "a list of 3 values has only 2");
}

TEST(ImportMeshDialects, PlyStrips) {
    const Triangles expected = {{0, 1, 2}, {2, 1, 3}, {1, 2, 4}};
    for (const std::string type : {"int", "short", "char"})
        for (const std::string encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
            std::string text = "ply\nformat " + encoding + " 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
            text += "element face 0\nproperty list uchar int vertex_indices\n";
            text += "element tristrips 1\nproperty list int " + type + " vertex_indices\nend_header\n";
            const bool ascii = encoding == "ascii", big = encoding == "binary_big_endian";
            const auto number = [&]<class T>(T value) { return ascii ? std::to_string(+value) + " " : bytes_of(value, big); };
            for (int i = 0; i < 5; ++i) text += number(float(i % 2)) + number(float(i / 2)) + number(float(i * i)) + (ascii ? "\n" : "");
            text += number(int32_t{9});
            for (const int i : {0, 1, 2, 3, -1, 1, 2, 4, -1})
                text += type == "int" ? number(int32_t{i}) : type == "short" ? number(int16_t(i)) : number(int8_t(i));
            const Loaded loaded = load_text("a.ply", text);
            ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
            EXPECT_EQ(loaded.mesh.triangles, expected) << type << " " << encoding;
        }
}

TEST(ImportMeshDialects, OffHeadersAndLayouts) {
    const std::string text = test::to_off(make_box()), body = text.substr(4);
    expect_box("a.off", "OFF" + body);
    expect_box("a.off", "OFF " + body);
    expect_box("a.off", body);
    expect_box("a.off", with(text, "8 12 0\n", "8 12\n"));
    expect_box("a.off", with(text, "\n", "\n# between\n\n"));
    expect_box("a.off", with(text, "\n", " "));
    expect_box("a.off", with(text, " ", "\n"));
    EXPECT_EQ(load_text("a.off", "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n").mesh.normals.size(), 3u);
    EXPECT_TRUE(load_text("a.off", "STOFF\n3 1 0\n0 0 0 0 1\n1 0 0 0 1\n0 1 0 0 1\n3 0 1 2\n").status.ok());
    expect_error(load_text("a.off", "4OFF\n3 1 0\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n"), "a.off:1: \"4OFF\" is a kind of OFF");
    const Loaded few = load_text("a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n2 0 1\n");
    EXPECT_EQ(few.issues.few_corners, 1u);
    EXPECT_EQ(few.mesh.triangles.size(), 1u);
}

TEST(ImportMeshDialects, BinaryStlOfAnotherLength) {
    const std::string good = test::to_stl_binary(make_box());
    const auto count = [&](uint32_t n) { return std::string(good).replace(80, 4, bytes_of(n)); };
    for (const std::string& content : {count(0), count(11), count(4294967295u), good + "ab", "solid" + good.substr(5) + "ab"}) {
        const Loaded loaded = load_text("a.stl", content);
        expect_warning(loaded, "12 are read");
        EXPECT_TRUE(corners(loaded.mesh) == corners(make_box()));
    }
    expect_warning(load_text("a.stl", good.substr(0, good.size() - 20)), "11 are read");
    expect_box("a.stl", "solid" + good.substr(5));
}

TEST(ImportMeshDialects, TextStlInOtherWords) {
    const std::string good = test::to_stl_text(make_box());
    expect_box("a.stl", with(with(with(good, "endloop", "end loop"), "endfacet", "end facet"), "endsolid", "end solid"));
    std::string upper = good;
    for (char& c : upper) c = static_cast<char>(std::toupper(c));
    expect_box("a.stl", upper);
    expect_box("a.stl", with(good, "\n", " "));
    const size_t middle = good.find(" facet", good.size() / 2);
    expect_box("a.stl", good.substr(0, middle) + "endsolid test\nsolid other one\n" + good.substr(middle));
    expect_warning(load_text("a.stl", good.substr(0, good.find("endsolid"))), "ends without endsolid");
    expect_error(load_text("a.stl", good.substr(0, good.rfind("vertex") + 9)), "a.stl:");
}

TEST(ImportMeshDialects, ObjStatementsThatAreUnknown) {
    const std::string good = test::to_obj(make_box());
    const Loaded loaded = load_text("a.obj", "$ a banner\n" + good + "c 1 1 1\nc 0 0 0\n");
    expect_warning(loaded, "a.obj:1: \"$\" is no statement of an OBJ file; 3 such lines are skipped");
    EXPECT_TRUE(corners(loaded.mesh) == corners(make_box()));
    expect_warning(load_text("a.obj", good + "l 1 2\n"), "\"l\" is no face; 1 such line is skipped");
}

TEST(ImportMeshDialects, ObjNumbersAndLines) {
    const std::string good = test::to_obj(make_box());
    for (const char* odd : {"1.#QNAN", "-1.#IND", "1.#INF", "-1.#INF00", "nan(ind)", "nan", "1e999", "1D+300"}) {
        const Loaded loaded = load_text("a.obj", good + "v 0 " + odd + " 0\nf 1 2 9\n");
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        EXPECT_EQ(loaded.issues.not_finite, 1u) << odd;
    }
    expect_box("a.obj", with(good, "v 1 2 3\n", "v 1.0D0 2.0d+00 3.0D+0#1.#QNAN\n"));
    expect_box("a.obj", with(good, "f 1 3 4\n", "f 1 3 \\ \t\n 4\n"));
    expect_box("a.obj", "# a path: C:\\\n" + good);
    const size_t faces = good.find("f ");
    expect_box("a.obj", good.substr(faces) + good.substr(0, faces));  // vertices come later
    expect_box("a.obj", with(good, "f 1 3 4\n", "fo 1/77 3/77 4/78\n"));
    EXPECT_EQ(load_text("a.obj", good + "f 1 2\nf 1\nf\n").issues.few_corners, 3u);
}

TEST(ImportMeshDialects, BackslashesInCommentsContinueNothing) { expect_box("a.obj", with(test::to_obj(make_box()), "\nf ", " # from C:\\\nf ")); }

TEST(ImportMeshDialects, RoundedNamesOfNan) {
    const std::string box = test::to_obj(make_box());
    for (const char* odd : {"1.#J", "-1.#J", "1.#R", "1.#J0"}) expect_box("a.obj", box + "vn " + odd + " 0 1\n");
}

TEST(ImportMeshDialects, PlyHeadersConvertedTwice) {
    const std::string text = test::to_ply_text(make_box());
    const size_t data = text.find("end_header\n") + 11;
    expect_box("a.ply", with(text.substr(0, data), "\n", "\r\r\n") + text.substr(data));
}

TEST(ImportMeshDialects, PlyNamesInCapitals) {
    const std::string header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float X\nproperty float Y\nproperty float Z\n";
    const std::string colors = "property uchar Red\nproperty uchar Green\nproperty uchar Blue\n";
    const Loaded loaded = load_text("a.ply", header + colors +
                                                 "element face 1\nproperty list uchar int Vertex_Indices\nend_header\n"
                                                 "0 0 0 1 2 3\n1 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 2\n");
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    ASSERT_EQ(loaded.mesh.colors.size(), 3u);
    EXPECT_EQ(loaded.mesh.colors[0], 0x030201u);
}

}  // namespace
}  // namespace raypager
