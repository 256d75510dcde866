// Which objects of pbrt become objects of the scene, which are written out as shapes, and that both stand in the same places.
#include <cerrno>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "support/failing_file_system.hpp"
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

// One object is placed once and one is small, so they become shapes; one shines, so it never was an instance.
std::string many_placed(const std::string& object) {
    std::string text = "WorldBegin\nObjectBegin \"o\" Translate 70000.5 0 0 " + object + "ObjectEnd\nObjectBegin \"once\" " + object +
                       "ObjectEnd\nObjectBegin \"small\" Shape \"sphere\" ObjectEnd\n" +
                       "ObjectBegin \"lamp\" AreaLightSource \"diffuse\" Shape \"sphere\" ObjectEnd\n";
    for (int i = 0; i < 23; i++) {
        text += "Translate 1 0 0.25 ObjectInstance \"o\"\n";
        if (i % 5 == 0) text += "ObjectInstance \"small\"\n";
        if (i == 11) text += "Scale 1 2 1 ObjectInstance \"once\" ObjectInstance \"lamp\"\n";
    }
    return text;
}

TEST_F(ImportPbrtObjects, ManyGoOverTheDiskAndAreTheSame) {
    const auto path = folder.write("scene.pbrt", many_placed(grid(3)));
    auto in_memory = PbrtReader().read(path);
    ASSERT_TRUE(in_memory.ok()) << in_memory.status().message();
    const auto expected = placements(*in_memory);
    ASSERT_EQ(expected.size(), 23u);
    ASSERT_EQ(in_memory->shapes.size(), 1u + 5 + 1);
    for (const size_t most : {1, 2, 5, 23, 28}) {
        SCOPED_TRACE(most);
        auto on_disk = PbrtReader({}, most).read(path);
        ASSERT_TRUE(on_disk.ok()) << on_disk.status().message();
        ASSERT_EQ(on_disk->instances.size(), 1u);
        EXPECT_EQ(on_disk->instances[0]->count(), 23u);
        EXPECT_EQ(on_disk->instances[0]->fingerprint(), in_memory->instances[0]->fingerprint());
        const auto all = placements(*on_disk);
        ASSERT_EQ(all.size(), expected.size());
        for (size_t i = 0; i < all.size(); i++) {
            EXPECT_EQ(all[i].object, expected[i].object);
            EXPECT_EQ(all[i].to_world, expected[i].to_world);
        }
        ASSERT_EQ(on_disk->shapes.size(), in_memory->shapes.size());
        for (size_t i = 0; i < on_disk->shapes.size(); i++) EXPECT_EQ(on_disk->shapes[i].to_world.m, in_memory->shapes[i].to_world.m);
        EXPECT_EQ(placements(*on_disk).size(), 23u) << "the second time";
    }
    EXPECT_EQ(InstancesInMemory("copies", expected).fingerprint(), in_memory->instances[0]->fingerprint());
}

TEST_F(ImportPbrtObjects, AFailingDiskIsOneClearError) {
    const auto path = folder.write("scene.pbrt", many_placed(grid(3)));
    support::FailingFileSystem disk;
    for (const int after : {1, 2, 5}) {
        disk.error_number = ENOSPC;
        disk.fail_write_in = after;
        const auto full = PbrtReader({}, 4).read(path);
        ASSERT_FALSE(full.ok()) << after;
        EXPECT_NE(full.status().message().find("scene.pbrt:"), std::string::npos) << full.status().message();
        EXPECT_NE(full.status().message().find("no room for so many instances"), std::string::npos) << full.status().message();
        EXPECT_NE(full.status().message().find("No space left on device"), std::string::npos) << full.status().message();
        EXPECT_NE(full.status().message().find("set TMPDIR"), std::string::npos) << full.status().message();
        disk.clear();
    }
    auto scene = PbrtReader({}, 4).read(path);
    ASSERT_TRUE(scene.ok());
    disk.error_number = EIO;
    disk.fail_read_in = 1;
    const Status read = scene->instances[0]->stream([](std::span<const Placement>) { return Status(); });
    EXPECT_NE(read.message().find("cannot be read"), std::string::npos) << read.message();
}

// Numbers are taken in one go where they are as usual, and one by one where they are not.
TEST_F(ImportPbrtObjects, UnusualNumbersOfTransformsAreTheSameNumbers) {
    const std::string object = "WorldBegin\nObjectBegin \"o\" " + grid(3) + "ObjectEnd\n";
    const std::string usual = "Transform [ 2 0 0 0 0 -0.5 0 0 0 0 1 0 1e2 -.25 3e-2 1 ]\n", instance = "ObjectInstance \"o\"\n";
    const std::string unusual = "Transform[+2,0 0 0\r\n0,-5e-1 # a word [ \"\n 0\t0 0 0 +1 0 1e+2 -2.5E-1 .03 1]\n";
    const auto all = placements(scene(object + usual + instance + unusual + instance));
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].to_world, all[1].to_world);
    EXPECT_EQ(all[0].to_world[1], (std::array<double, 4>{0, -0.5, 0, -0.25}));
    for (const std::string bad : {"nan", "-inf", "1x", "0x1", "1e999", "\"1\"", "]"}) {
        SCOPED_TRACE(bad);
        expect_error(object + "Transform [ 2 0 0 0\n 0 2 0 0   " + bad + " 0 1 0 0 0 0 1 ] " + instance, "scene.pbrt:5:12: ");
    }
}

// pbrt has no instances in objects; here they mean what one expects. Each shape of the innermost object, however it comes there, is where copies by
// hand would be.
TEST_F(ImportPbrtObjects, MayPlaceOthers) {
    const auto text = [&](const std::string& light) {
        return "WorldBegin\nObjectBegin \"leaf\" " + grid(2) + "ObjectEnd\nObjectBegin \"tree\" Translate 0 0 1 " + grid(3) + "AttributeBegin " +
               light + grid(2) + "AttributeEnd Scale 1 -2 1 ObjectInstance \"leaf\" Translate 0 0 5 ObjectInstance \"leaf\" ObjectEnd\n" +
               "Rotate 30 0 1 0 Scale 1 1.5 1 ObjectInstance \"tree\" Translate 9 0 0 ObjectInstance \"tree\" ObjectInstance \"leaf\"\n";
    };
    const Scene nested = scene(text("")), copied = scene(text("AttributeBegin AreaLightSource \"diffuse\" Shape \"sphere\" AttributeEnd "));
    ASSERT_EQ(nested.objects.size(), 2u);
    EXPECT_EQ(nested.objects[0].name, "leaf");
    EXPECT_TRUE(nested.objects[0].instances.empty());
    EXPECT_TRUE(nested.shapes.empty());
    ASSERT_EQ(nested.objects[1].instances.size(), 1u);
    const auto in_world = placements(nested);
    ASSERT_EQ(in_world.size(), 3u);
    Scene tree;
    tree.instances = nested.objects[1].instances;
    const auto in_tree = placements(tree);
    ASSERT_EQ(in_tree.size(), 2u);
    // A tree with a sphere that shines, and which is stretched is written out, and its leaves are placed in the world.
    ASSERT_EQ(copied.objects.size(), 1u);
    EXPECT_EQ(copied.shapes.size(), 6u);
    const auto leaves = placements(copied);
    ASSERT_EQ(leaves.size(), 5u);
    const Shape& leaf = nested.objects[0].shapes[0];
    for (size_t t = 0; t < 2; t++) {
        EXPECT_EQ(in_world[t].object, 1u);
        for (size_t k = 0; k < 2; k++) {
            expect_near(placed(in_world[t], nested.objects[1].shapes[k]), copied.shapes[3 * t + 2 * k].to_world);
            Shape moved = leaf;
            moved.to_world = placed(in_tree[k], leaf);
            expect_near(placed(in_world[t], moved), placed(leaves[2 * t + k], leaf));
        }
    }
    EXPECT_EQ(in_world[2].object, 0u);
    expect_near(placed(in_world[2], leaf), placed(leaves[4], leaf));
}

// A sphere that shines may come to be stretched: it goes into the object that places it, not into the world.
TEST_F(ImportPbrtObjects, TakeInRoundLights) {
    const std::string lamp = "ObjectBegin \"lamp\" AreaLightSource \"diffuse\" Shape \"sphere\" ObjectEnd\n";
    const Scene s = scene("WorldBegin\n" + lamp + "ObjectBegin \"post\" " + grid(3) + "Translate 0 0 7 ObjectInstance \"lamp\" ObjectEnd\n" +
                          "ObjectInstance \"post\" Translate 0 9 0 ObjectInstance \"post\"\n");
    EXPECT_TRUE(s.shapes.empty());
    ASSERT_EQ(s.objects.size(), 1u);
    ASSERT_EQ(s.objects[0].shapes.size(), 2u);
    EXPECT_TRUE(s.objects[0].shapes[1].area_light.has_value());
    expect_near(s.objects[0].shapes[1].to_world, Transform::translate(0, 0, 7));
    const Scene alone = scene("WorldBegin\n" + lamp + "ObjectBegin \"post\" ObjectInstance \"lamp\" ObjectEnd Scale 1 2 1 ObjectInstance \"post\" " +
                              "ObjectInstance \"post\"\n");
    EXPECT_EQ(alone.shapes.size(), 2u);
    for (const Shape& shape : alone.shapes) EXPECT_TRUE(shape.area_light.has_value());
}

TEST_F(ImportPbrtObjects, ThatNobodyPlacesAreLeftOut) {
    const Scene s = scene("WorldBegin\nObjectBegin \"leaf\" " + grid(2) + "ObjectEnd\nObjectBegin \"twig\" " + grid(3) +
                          "ObjectInstance \"leaf\" ObjectInstance \"leaf\" ObjectEnd\nObjectBegin \"o\" " + grid(3) + "ObjectEnd\n" + twice);
    ASSERT_EQ(s.objects.size(), 1u);
    EXPECT_EQ(s.objects[0].name, "o");
}

// An object comes behind those that it places, also if it has the name of one before.
TEST_F(ImportPbrtObjects, ComeBehindWhatTheyPlace) {
    const Scene s = scene("WorldBegin\nObjectBegin \"o\" " + grid(2) + "ObjectEnd\nObjectBegin \"leaf\" " + grid(2) +
                          "ObjectEnd\nObjectBegin \"o\" ObjectInstance \"leaf\" Translate 1 1 1 ObjectInstance \"leaf\" ObjectEnd\n" + twice);
    ASSERT_EQ(s.objects.size(), 2u);
    EXPECT_EQ(s.objects[1].name, "o");
    EXPECT_TRUE(s.objects[1].shapes.empty());
    EXPECT_EQ(s.objects[1].instances.at(0)->count(), 2u);
}

// Far from the origin of its space an object gets another, and what it places stays where it is.
TEST_F(ImportPbrtObjects, FarAwayPlaceOthersToo) {
    const Scene s =
        scene("WorldBegin\nObjectBegin \"leaf\" Translate 200000 0 0 " + grid(2) + "ObjectEnd\nObjectBegin \"tree\" Translate 0 900000 0 " + grid(3) +
              "ObjectInstance \"leaf\" ObjectEnd\n" + "ObjectInstance \"tree\" Scale 2 2 2 ObjectInstance \"tree\"\n");
    ASSERT_EQ(s.objects.size(), 2u);
    Scene tree;
    tree.instances = s.objects[1].instances;
    const auto in_tree = placements(tree);
    ASSERT_EQ(in_tree.size(), 1u);
    Shape moved = s.objects[0].shapes[0];
    moved.to_world = placed(in_tree[0], moved);
    EXPECT_LT(std::abs(moved.to_world.m[0][3]), 200001);
    EXPECT_LT(std::abs(moved.to_world.m[1][3]), 1);
    expect_near(placed(placements(s)[1], moved), Transform::scale(2, 2, 2) * Transform::translate(200000, 900000, 0));
}

}  // namespace
}  // namespace raypager
