// Polygons become triangles that cover what they enclose.
#include <gtest/gtest.h>

#include <cmath>

#include "unit/import_files.hpp"
#include "unit/import_load.hpp"

namespace raypager {
namespace {

using test::bytes_of;
using test::load_text;
using test::Loaded;

// Of triangles that lie in the plane z = 0: the sum, and the sum without signs, which is larger where they overlap or lie outside.
struct Areas {
    double sum = 0, unsigned_sum = 0;
};
Areas areas(const TriangleMesh& mesh) {
    Areas result;
    for (const auto& [a, b, c] : test::corners(mesh)) {
        const double area = 0.5 * ((double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x));
        result.sum += area;
        result.unsigned_sum += std::abs(area);
    }
    return result;
}

struct Outline {
    const char* name;
    std::vector<std::pair<int, int>> corners;
    double area;
    size_t triangles;
};
const std::vector<Outline> outlines = {
    {"an L from a corner that makes a fan leave it", {{1, 1}, {3, 1}, {3, 0}, {0, 0}, {0, 2}, {1, 2}}, -4, 4},
    {"an arrow head", {{0, 0}, {2, 1}, {0, 2}, {1, 1}}, 1, 2},
    {"a comb", {{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1}, {5, 3}, {4, 3}, {4, 1}, {3, 1}, {3, 3}, {0, 3}}, 17, 10},
    {"a square with a hole that a cut joins to it", {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}}, 12, 8},
    {"an arrow head with a corner twice", {{0, 0}, {2, 1}, {2, 1}, {0, 2}, {1, 1}}, 1, 2},
    {"an arrow head that is closed", {{0, 0}, {2, 1}, {0, 2}, {1, 1}, {0, 0}}, 1, 2},
};

std::string obj_of(const Outline& outline) {
    std::string points, face = "f";
    size_t number = 0;
    for (const auto& [x, y] : outline.corners) {
        points += "v " + std::to_string(x) + " " + std::to_string(y) + " 0\n";
        face += " " + std::to_string(++number);
    }
    return points + face + "\n";
}

std::string binary_ply_of(const Outline& outline) {
    std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(outline.corners.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto& [x, y] : outline.corners) text += bytes_of(float(x)) + bytes_of(float(y)) + bytes_of(0.0f);
    text += bytes_of(static_cast<uint8_t>(outline.corners.size()));
    for (size_t i = 0; i < outline.corners.size(); ++i) text += bytes_of(static_cast<int32_t>(i));
    return text;
}

TEST(ImportPolygons, ConcaveOnesAreCutAlongTheirOutline) {
    for (const Outline& outline : outlines) {
        SCOPED_TRACE(outline.name);
        for (const auto& [file, content] : {std::pair{"a.obj", obj_of(outline)}, {"a.ply", binary_ply_of(outline)}}) {
            const Loaded loaded = load_text(file, content);
            ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
            EXPECT_EQ(loaded.mesh.triangles.size(), outline.triangles);
            EXPECT_NEAR(areas(loaded.mesh).sum, outline.area, 1e-9);
            EXPECT_NEAR(areas(loaded.mesh).unsigned_sum, std::abs(outline.area), 1e-9);
            EXPECT_EQ(loaded.issues.crossed, 0u);
        }
    }
}

// A binary PLY that is handed on in pieces has no vertices left when its faces come.
TEST(ImportPolygons, StreamsAreCutAlike) {
    class Collector final : public MeshSink {
    public:
        Status vertices(const MeshVertices& v) override {
            mesh.positions.insert(mesh.positions.end(), v.positions.begin(), v.positions.end());
            return {};
        }
        Status triangles(std::span<const Triangle> t) override {
            mesh.triangles.insert(mesh.triangles.end(), t.begin(), t.end());
            return {};
        }
        TriangleMesh mesh;
    };
    const support::TemporaryFolder folder;
    for (const Outline& outline : outlines) {
        const auto file = MeshFile::open(folder.write("a.ply", binary_ply_of(outline)));
        ASSERT_TRUE(file.ok());
        Collector sink;
        MeshIssues issues;
        ASSERT_TRUE((*file)->stream(sink, issues).ok());
        EXPECT_NEAR(areas(sink.mesh).unsigned_sum, std::abs(outline.area), 1e-9) << outline.name;
    }
}

TEST(ImportPolygons, ConvexOnesStayFans) {
    const Loaded loaded = load_text("a.obj", "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 3 4 5 1 2\n");
    EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{2, 3, 4}, {2, 4, 0}, {2, 0, 1}}));
}

TEST(ImportPolygons, ThoseThatCrossThemselvesAreFansAndCounted) {
    for (const char* content : {"v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 2 0\nf 1 2 3 4\n",                 // an hourglass
                                "v 0 3 0\nv 2 -3 0\nv -3 1 0\nv 3 1 0\nv -2 -3 0\nf 1 2 3 4 5\n",  // a pentagram
                                "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 1 -1 0\nv 0 3 0\nf 1 2 3 4 5\n"}) {
        const Loaded loaded = load_text("a.obj", content);
        ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
        EXPECT_EQ(loaded.issues.crossed, 1u) << content;
        EXPECT_GE(loaded.mesh.triangles.size(), 2u);
    }
    EXPECT_NE(load_text("a.obj", "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 2 0\nf 1 2 3 4\n").issues.describe().find("1 polygon that crosses itself"),
              std::string::npos);
}

// Normals and colours stay with their corners, on planes of any direction.
TEST(ImportPolygons, CornersKeepWhatTheyHave) {
    const Loaded loaded = load_text("a.obj", "v 5 0 0\nv 5 2 1\nv 5 0 2\nv 5 1 1\nvn 0 0 1\nvn 0 0 2\nvn 0 0 3\nvn 0 0 4\nf 1//1 2//2 3//3 4//4\n");
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    ASSERT_EQ(loaded.mesh.triangles.size(), 2u);
    for (const Triangle& t : loaded.mesh.triangles) {
        EXPECT_EQ(std::count(t.begin(), t.end(), 3u), 1) << "the diagonal begins at the concave corner";
        for (const uint32_t v : t) EXPECT_EQ(loaded.mesh.normals[v].z, float(v + 1));
    }
}

// Works that would never end, or take memory without bound, are given up.
TEST(ImportPolygons, IntricateOnesTakeBoundedTime) {
    std::string points, face = "f";
    for (int i = 0; i < 20000; ++i) {
        points += "v " + std::to_string(i * 7919 % 10007) + " " + std::to_string(i * 104729LL % 10009) + " 0\n";
        face += " " + std::to_string(i + 1);
    }
    const Loaded loaded = load_text("a.obj", points + face + "\n");
    ASSERT_TRUE(loaded.status.ok());
    EXPECT_EQ(loaded.issues.crossed, 1u);
}

}  // namespace
}  // namespace raypager
