// Clouds in formats of meshes, and what else may stand in these without making them unreadable.
#include <gtest/gtest.h>

#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;

std::vector<CloudPoint> points_of(const Scene& scene) {
    std::vector<CloudPoint> points;
    MeshIssues issues;
    const auto take = [&](std::span<const CloudPoint> some) {
        points.insert(points.end(), some.begin(), some.end());
        return Status();
    };
    for (const Shape& shape : scene.shapes) {
        if (shape.points && !shape.points->stream(take, issues).ok()) ADD_FAILURE() << shape.name;
    }
    return points;
}

TEST(ImportVertexPoints, OffWithoutFacesIsACloud) {
    const char* const files[] = {"OFF\n4 0 0\n0 0 0\n1 0 0\n# a comment\n0 1 0\n\n0 0 1\n", "OFF4 0 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n",
                                 "OFF 4 0\n0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n",
                                 "COFF\n4 0 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n0 0 1 255 0 0 255\n"};
    for (const char* content : files) {
        SCOPED_TRACE(content);
        const TemporaryFolder folder;
        const auto scene = import_scene({folder.write("a.off", content)});
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        const auto points = points_of(*scene);
        ASSERT_EQ(points.size(), 4u);
        EXPECT_EQ(points[3].position.z, 1);
        EXPECT_EQ(points[0].color, content[0] == 'C' ? 255u : 0xffffffu);
    }
    const TemporaryFolder folder;
    const auto scene = import_scene({folder.write("a.off", "OFF\n4 0 0\n0 0 0\n1 0 0\n0 1 0\n")});
    ASSERT_TRUE(scene.ok());
    MeshIssues issues;
    const Status cut = scene->shapes[0].points->stream([](std::span<const CloudPoint>) { return Status(); }, issues);
    EXPECT_NE(cut.message().find("ends after 3 of 4 vertices"), std::string::npos) << cut.message();
}

TEST(ImportVertexPoints, ObjWithoutFacesIsACloud) {
    const TemporaryFolder folder;
    const std::string vertices = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\r\nvn 0 0 1\np 1 2 3\ns off\n";
    const auto scene = import_scene({folder.write("a.obj", vertices)});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    const auto points = points_of(*scene);
    ASSERT_EQ(points.size(), 3u);
    EXPECT_EQ(points[1].position.x, 1);
    EXPECT_EQ(points[1].color, 255u);
    // Lines between them are nothing that could be left out without a word.
    EXPECT_FALSE(import_scene({folder.write("b.obj", vertices + "l 1 2\n")}).ok());
    EXPECT_FALSE(import_scene({folder.write("c.obj", "vn 0 0 1\n")}).ok());
    const auto mesh = import_scene({folder.write("d.obj", "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r")});
    ASSERT_TRUE(mesh.ok()) << mesh.status().message();
    EXPECT_TRUE(mesh->shapes[0].mesh);
}

// What other readers pass over is passed over, with a warning.
TEST(ImportVertexPoints, WhatMeshesNeedNotHaveIsPassedOver) {
    const std::string header =
        "ply\nformat ascii 1.0\nCreated by some program\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    const struct {
        const char *file, *warning;
        std::string content;
    } cases[] = {
        {"a.off", ":7: text after the last face", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n"},
        {"a.ply", ":3: \"Created by some program\"",
         header + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
    };
    for (const auto& c : cases) {
        const TemporaryFolder folder;
        const auto scene = import_scene({folder.write(c.file, c.content)});
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        TriangleMesh mesh;
        MeshIssues issues;
        ASSERT_TRUE(scene->shapes[0].mesh->load(mesh, issues).ok());
        EXPECT_EQ(mesh.triangles.size(), 1u);
        ASSERT_EQ(issues.warnings.size(), 1u) << c.file;
        EXPECT_NE(issues.warnings[0].text.find(c.warning), std::string::npos) << issues.warnings[0].text;
    }
    const TemporaryFolder folder;
    const auto cloud = import_scene({folder.write("b.ply", header + "end_header\n0 0 0\n1 0 0\n0 1 0\n")});
    ASSERT_TRUE(cloud.ok()) << cloud.status().message();
    EXPECT_EQ(points_of(*cloud).size(), 3u);
    ASSERT_FALSE(cloud->warnings.empty());
}

}  // namespace
}  // namespace raypager
