// Which objects of pbrt become objects of the scene, which are written out as shapes, and that both stand in the same places.
#include <cmath>

#include "unit/import_files.hpp"
#include "unit/pbrt_fixture.hpp"

namespace raypager {
namespace {

class ImportPbrtObjects : public test::PbrtTest {
protected:
    // Of a grid of n x n quads.
    static std::string grid(int n) {
        std::string points, indices;
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) points += std::to_string(i) + " " + std::to_string(j) + " 0 ";
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const int a = j * (n + 1) + i, c = a + n + 1;
                for (const int v : {a, a + 1, c, a + 1, c + 1, c}) indices += std::to_string(v) + " ";
            }
        return "Shape \"trianglemesh\" \"point3 P\" [" + points + "] \"integer indices\" [" + indices + "]\n";
    }
    static std::vector<Placement> placements(const Scene& scene) {
        std::vector<Placement> all;
        for (const auto& source : scene.instances)
            EXPECT_TRUE(
                source->stream([&](std::span<const Placement> some) { return all.insert(all.end(), some.begin(), some.end()), Status(); }).ok());
        return all;
    }
    // Of one shape of an object, in the world.
    static Transform placed(const Placement& placement, const Shape& shape) {
        Transform to_world;
        std::copy(placement.to_world.begin(), placement.to_world.end(), to_world.m.begin());
        return to_world * shape.to_world;
    }
    static void expect_near(const Transform& a, const Transform& b) {
        for (size_t i = 0; i < 4; ++i)
            for (size_t j = 0; j < 4; ++j) EXPECT_NEAR(a.m[i][j], b.m[i][j], 1e-9) << i << " " << j;
    }
    const std::string twice = "ObjectInstance \"o\" Translate 0 0 9 ObjectInstance \"o\"\n";
};

TEST_F(ImportPbrtObjects, PlacedTwiceAreInstances) {
    const Scene s = scene("WorldBegin\nShape \"sphere\"\nObjectBegin \"o\" Translate 1 0 0 " + grid(2) + "Material \"dielectric\" " + grid(3) +
                          "ObjectEnd\nScale 1 2 -3\nObjectInstance \"o\"\nRotate 30 1 2 3\nObjectInstance \"o\"\nObjectInstance \"o\"\n");
    EXPECT_EQ(s.shapes.size(), 1u);
    ASSERT_EQ(s.objects.size(), 1u);
    EXPECT_EQ(s.objects[0].name, "o");
    ASSERT_EQ(s.objects[0].shapes.size(), 2u);
    EXPECT_EQ(s.materials[s.objects[0].shapes[1].material].kind, RP_MATERIAL_DIELECTRIC);
    ASSERT_EQ(s.instances.size(), 1u);
    EXPECT_EQ(s.instances[0]->name(), (folder / "scene.pbrt").string());
    EXPECT_EQ(s.instances[0]->count(), 3u);
    const auto all = placements(s);
    const Transform stretched = Transform::scale(1, 2, -3), own = Transform::translate(1, 0, 0);
    for (const Shape& shape : s.objects[0].shapes) {
        expect_near(shape.to_world, own);
        expect_near(placed(all[0], shape), stretched * own);
        expect_near(placed(all[1], shape), stretched * Transform::rotate(30, 1, 2, 3) * own);
        expect_near(placed(all[2], shape), placed(all[1], shape));
    }
}

// A sphere that shines and is stretched makes the same objects copies: what is beside it must be where these are.
TEST_F(ImportPbrtObjects, StandWhereTheirCopiesWould) {
    const auto text = [&](const std::string& light) {
        return "WorldBegin\nRotate 20 0 1 0\nObjectBegin \"o\" ReverseOrientation Translate 1 2 3 Scale -1 1 2 " + grid(3) + grid(2) + light +
               "ObjectEnd\nTranslate 5 0 0 Scale 1 1 -1\nReverseOrientation ObjectInstance \"o\"\nScale 2 1 1 ObjectInstance \"o\"\n";
    };
    const Scene instances = scene(text(""));
    const Scene copies = scene(text("ReverseOrientation Scale 1 1 0.5 AreaLightSource \"diffuse\" Shape \"sphere\" "));
    ASSERT_EQ(copies.shapes.size(), 6u);
    EXPECT_TRUE(copies.objects.empty() && copies.instances.empty());
    ASSERT_EQ(instances.objects.size(), 1u);
    EXPECT_TRUE(instances.shapes.empty());
    const auto all = placements(instances);
    ASSERT_EQ(all.size(), 2u);
    for (size_t i = 0; i < 2; ++i)
        for (size_t k = 0; k < 2; ++k) {
            const Shape &copy = copies.shapes[3 * i + k], &shape = instances.objects[0].shapes[k];
            expect_near(placed(all[i], shape), copy.to_world);
            EXPECT_EQ(shape.reverse_orientation, copy.reverse_orientation);
            EXPECT_TRUE(shape.reverse_orientation);
        }
}

TEST_F(ImportPbrtObjects, PlacedOnceAreShapes) {
    const Scene s = scene("WorldBegin\nObjectBegin \"o\" " + grid(3) + "ObjectEnd ObjectBegin \"never\" " + grid(3) +
                          "ObjectEnd\nTranslate 0 0 2 ObjectInstance \"o\"\n");
    EXPECT_TRUE(s.objects.empty() && s.instances.empty());
    ASSERT_EQ(s.shapes.size(), 1u);
    expect_near(s.shapes[0].to_world, Transform::translate(0, 0, 2));
    expect_error("WorldBegin\nObjectBegin \"never\" " + grid(3) + "ObjectEnd\n", "has no shape");
}

TEST_F(ImportPbrtObjects, WhatMustStayCopies) {
    folder.write("c.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n1 1 0\n0 1 1\n1 0 1\n");
    const std::string cloud = "Shape \"points\" \"string filename\" \"c.xyz\" ";
    const auto imported = [&](const std::string& shapes) { return scene("WorldBegin\nObjectBegin \"o\" " + shapes + " ObjectEnd\n" + twice); };
    const auto copies = [&](const std::string& shapes) {
        const Scene s = imported(shapes);
        return s.objects.empty() && s.instances.empty() ? s.shapes.size() : 0;
    };
    const std::string glow = " AreaLightSource \"diffuse\" ";
    EXPECT_EQ(imported(grid(3) + glow + grid(3)).objects.size(), 1u) << "shines somewhere";
    EXPECT_EQ(imported(grid(3) + glow + "Shape \"sphere\" \"float alpha\" 0").objects.size(), 1u) << "shines unseen";
    EXPECT_EQ(imported(grid(3) + glow + "Shape \"sphere\"").objects.size(), 1u) << "a sphere shines";
    // The second of two is stretched.
    const Scene stretched =
        scene("WorldBegin\nObjectBegin \"o\" " + grid(3) + glow + "Shape \"sphere\" ObjectEnd\n" + twice + "Scale 1 2 1 ObjectInstance \"o\"\n");
    EXPECT_TRUE(stretched.objects.empty());
    EXPECT_EQ(stretched.shapes.size(), 6u);
    EXPECT_EQ(copies(cloud + " \"float radius\" 1"), 2u) << "a radius in the world";
    EXPECT_EQ(copies(grid(1)), 2u) << "small";
    EXPECT_EQ(copies("Shape \"sphere\""), 2u) << "one sphere";
    expect_error("WorldBegin\nObjectBegin \"o\" ObjectEnd\n" + twice, "has no shape");
    EXPECT_EQ(imported(cloud).objects.size(), 1u);
    EXPECT_EQ(imported(grid(2)).objects.size(), 1u);
    EXPECT_EQ(imported("Shape \"sphere\" Translate 1 0 0 Shape \"sphere\"").objects.size(), 1u);
    folder.write("box.ply", test::to_ply_binary(test::make_box(1, 1, 1)));
    EXPECT_EQ(imported("Shape \"plymesh\" \"string filename\" \"box.ply\"").objects.size(), 1u);
}

TEST_F(ImportPbrtObjects, SmallOnesAreInstancesIfThereAreVeryMany) {
    std::string text = "WorldBegin\nObjectBegin \"o\" " + test::one_triangle + "ObjectEnd\nObjectBegin \"p\" " + grid(3) + "ObjectEnd\n";
    for (int i = 0; i < 70'000; ++i) text += "Translate 1 0 0 ObjectInstance \"o\"\n";
    text += "ObjectInstance \"p\"";
    const Scene s = scene(text);
    ASSERT_EQ(s.objects.size(), 1u);
    EXPECT_EQ(s.instances[0]->count(), 70'000u);
    ASSERT_EQ(s.shapes.size(), 1u);
    expect_near(s.shapes[0].to_world, Transform::translate(70'000, 0, 0));
    EXPECT_EQ(placements(s)[69'999].to_world[0][3], 70'000);
}

TEST_F(ImportPbrtObjects, KeepWhatTheyWereWhenTheirNameIsGivenAgain) {
    const Scene s = scene("WorldBegin\nObjectBegin \"o\" " + grid(2) +
                          "ObjectEnd\nObjectInstance \"o\" Translate 1 0 0 ObjectInstance \"o\"\nObjectBegin \"o\" " + grid(3) +
                          "ObjectEnd\nTranslate 1 0 0 ObjectInstance \"o\" ObjectInstance \"o\" ObjectInstance \"o\"\n");
    ASSERT_EQ(s.objects.size(), 2u);
    TriangleMesh mesh;
    MeshIssues issues;
    ASSERT_TRUE(s.objects[0].shapes[0].mesh->load(mesh, issues).ok());
    EXPECT_EQ(mesh.triangles.size(), 8u);
    std::string order;
    for (const Placement& placement : placements(s)) order += std::to_string(placement.object);
    EXPECT_EQ(order, "00111");
}

// A sphere in an object may be stretched by its instances; one with textures around it is a mesh that has these.
TEST_F(ImportPbrtObjects, SpheresStaySpheresWithoutTextures) {
    const std::string two = "Shape \"sphere\" Translate 3 0 0 Shape \"sphere\" ";
    const Scene plain = scene("WorldBegin\nObjectBegin \"o\" " + two + "ObjectEnd Scale 1 2 1 " + twice);
    ASSERT_EQ(plain.objects.size(), 1u);
    for (const Shape& shape : plain.objects[0].shapes) EXPECT_FALSE(shape.mesh);
    const Scene textured =
        scene("WorldBegin\nTexture \"t\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"t\"\nObjectBegin \"o\" " + two +
              "ObjectEnd " + twice);
    ASSERT_EQ(textured.objects.size(), 1u);
    for (const Shape& shape : textured.objects[0].shapes) {
        TriangleMesh mesh;
        MeshIssues issues;
        ASSERT_TRUE(shape.mesh && shape.mesh->load(mesh, issues).ok());
        EXPECT_EQ(mesh.uvs.size(), mesh.positions.size());
    }
}

TEST_F(ImportPbrtObjects, AreBroughtNearTheOriginOfTheirOwnSpace) {
    const Scene s = scene("WorldBegin\nObjectBegin \"o\" Translate 500000.25 7 -900000 " + grid(3) + "Translate 1 0 0 " + grid(2) +
                          "ObjectEnd\nTranslate -500000 0 900000\n" + twice);
    ASSERT_EQ(s.objects.size(), 1u);
    const auto all = placements(s);
    EXPECT_EQ(s.objects[0].shapes[0].to_world.point(0, 0, 0), (std::array<double, 3>{0.25, 0, 0}));
    EXPECT_EQ(placed(all[0], s.objects[0].shapes[0]).point(0, 0, 0), (std::array<double, 3>{0.25, 7, 0}));
    EXPECT_EQ(placed(all[1], s.objects[0].shapes[1]).point(0, 0, 0), (std::array<double, 3>{1.25, 7, 9}));
}

TEST_F(ImportPbrtObjects, WarningsAreSaidOnceAndNothingIsPlacedFlat) {
    const Scene s =
        expect_warning("WorldBegin\nObjectBegin \"o\" " + grid(3) + "ObjectEnd\n" + twice + "Scale 1 0 1 ObjectInstance \"o\" ObjectInstance \"o\"",
                       "flattens an instance; it is left out (and 1 more of the same)");
    EXPECT_EQ(placements(s).size(), 2u);
    const Scene dark = expect_warning("WorldBegin\nObjectBegin \"o\" " + grid(3) + "ObjectEnd\n" + twice, "there is no light");
    EXPECT_EQ(dark.warnings.size(), 1u);
}

TEST_F(ImportPbrtObjects, FilesOfAScene) {
    folder.write("box.ply", test::to_ply_binary(test::make_box(1, 1, 1)));
    folder.write("places.pbrt", twice + twice);
    const Scene s = scene("WorldBegin\nObjectBegin \"o\" Shape \"plymesh\" \"string filename\" \"box.ply\" ObjectEnd\nInclude \"places.pbrt\"\n");
    EXPECT_EQ(s.files, (std::vector<std::string>{(folder / "scene.pbrt").string(), (folder / "places.pbrt").string()}));
    ASSERT_EQ(s.objects.size(), 1u);
    EXPECT_EQ(s.objects[0].shapes[0].mesh->files(), (std::vector<std::string>{(folder / "box.ply").string()}));
    EXPECT_EQ(placements(s).size(), 4u);
}

TEST_F(ImportPbrtObjects, TooLittlePrecisionIsSaidOfTheNearestInstance) {
    const std::string object = "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nObjectBegin \"o\" " + grid(3) + "ObjectEnd\n";
    expect_silence(object + "Translate 0 0 5 ObjectInstance \"o\" Translate 9e6 0 0 ObjectInstance \"o\"\n");
    expect_warning("LookAt 9e6 0 0  9e6 0 1  0 1 0\n" + object + "Translate 9e6 0 5 ObjectInstance \"o\" ObjectInstance \"o\"\n",
                   "leave too little precision");
}

}  // namespace
}  // namespace raypager
