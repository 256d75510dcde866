// Packed files (.gz) of every format.
#include <gtest/gtest.h>

#include "import/mesh_file.hpp"
#include "raypager/import.hpp"
#include "support/gzip.hpp"
#include "support/temporary_folder.hpp"
#include "unit/cloud_files.hpp"

namespace raypager {
namespace {

class ImportPacked : public testing::Test {
protected:
    // Triangles and points of a scene made of this file.
    uint64_t count(const std::string& name, const std::string& content) {
        const auto scene = import_scene({folder.write(name, support::gzip_of(content))});
        EXPECT_TRUE(scene.ok()) << name << ": " << scene.status().message();
        if (!scene.ok()) return 0;
        const Shape& shape = scene->shapes.at(0);
        if (shape.points) return shape.points->count();
        TriangleMesh mesh;
        MeshIssues issues;
        EXPECT_TRUE(shape.mesh->load(mesh, issues).ok()) << name;
        return mesh.triangles.size();
    }
    support::TemporaryFolder folder;
};

TEST_F(ImportPacked, EveryFormat) {
    const TriangleMesh box = test::make_box();
    EXPECT_EQ(count("a.ply.gz", test::to_ply_binary(box)), 12u);
    EXPECT_EQ(count("A.PLY.GZ", test::to_ply_binary(box)), 12u);
    EXPECT_EQ(count("named_otherwise.ply", test::to_ply_binary(box)), 12u);
#ifdef RAYPAGER_EDGES
    EXPECT_EQ(count("b.ply.gz", test::to_ply_text(box)), 12u);
    EXPECT_EQ(count("a.obj.gz", test::to_obj(box)), 12u);
    EXPECT_EQ(count("a.off.gz", test::to_off(box)), 12u);
    EXPECT_EQ(count("a.stl.gz", test::to_stl_text(box)), 12u);
    EXPECT_EQ(count("b.stl.gz", test::to_stl_binary(box)), 12u);
#endif
    EXPECT_EQ(count("a.las.gz", test::to_las(test::make_las(2, 3))), 40u);
    EXPECT_EQ(count("c.ply.gz", test::to_point_ply(test::some_points(), "ascii")), 40u);
    EXPECT_EQ(count("a.xyz.gz", "0 0 0\n1 0 2\n0 1 1"), 3u);
    const auto other = import_scene({folder.write("a.tar.gz", support::gzip_of("x"))});
    EXPECT_NE(other.status().message().find("of no kind"), std::string::npos);
}

TEST_F(ImportPacked, ScenesAndWhatTheyName) {
    folder.write("box.ply.gz", support::gzip_of(test::to_ply_binary(test::make_box())));
    folder.write("inner.pbrt.gz", support::gzip_of("Shape \"plymesh\" \"string filename\" \"box.ply.gz\"\n"));
    EXPECT_EQ(count("scene.pbrt.gz", "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nInclude \"inner.pbrt.gz\"\n"), 12u);
}

TEST_F(ImportPacked, SizesAndErrors) {
    const std::string content = test::to_ply_binary(test::make_box());
    const auto file = MeshFile::open(folder.write("a.ply.gz", support::gzip_of(content)));
    ASSERT_TRUE(file.ok());
    EXPECT_EQ((*file)->bytes_to_read(), content.size()) << "memory is planned by what it unpacks to";
    EXPECT_EQ((*file)->files(), std::vector{(folder / "a.ply.gz").string()}) << "the file whose changes count";
    const auto cut = MeshFile::open(folder.write("cut.ply.gz", support::gzip_of(content).substr(0, 200)));
    ASSERT_FALSE(cut.ok());
    EXPECT_EQ(cut.status().message().find((folder / "cut.ply.gz").string() + ": ends before its packed content"), 0u) << cut.status().message();
}

}  // namespace
}  // namespace raypager
