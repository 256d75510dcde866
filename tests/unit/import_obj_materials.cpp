// Materials of OBJ files, and what becomes of them in a bare scene.
#include <gtest/gtest.h>

#include <chrono>

#include "import/obj_materials.hpp"
#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/import_files.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;

const std::string two_triangles = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\n";

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const auto& line : lines) text += line + "\n";
    return text;
}

TEST(ImportObjMaterials, OneShapeAMaterial) {
    const TemporaryFolder folder;
    folder.write("my colours.mtl", "newmtl dark red\nKd 0.5 0.1 0.1\nnewmtl lamp\nKd 0 0 0\nKe 3 2 1\n");
    const auto path = folder.write(
        "a.obj", "mtllib my colours.mtl\n" + two_triangles + "f 1 2 3\nusemtl dark red\nf 2 4 3\nusemtl lamp\nf 3 2 4\nusemtl dark red\nf 4 2 1\n");
    const auto scene = import_scene({path});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_TRUE(scene->warnings.empty()) << joined(scene->warnings);
    ASSERT_EQ(scene->shapes.size(), 4u);  // with the ground
    const size_t triangles[] = {1, 2, 1};
    for (int round = 0; round < 2; ++round)  // from what was kept, and from the file again
        for (size_t i = 0; i < 3; ++i) {
            TriangleMesh mesh;
            MeshIssues issues;
            ASSERT_TRUE(scene->shapes[i].mesh->load(mesh, issues).ok());
            EXPECT_EQ(mesh.triangles.size(), triangles[i]);
            EXPECT_FALSE(issues.any()) << issues.describe();
        }
    const rp_material& red = scene->materials[scene->shapes[1].material];
    EXPECT_EQ(red.kind, RP_MATERIAL_DIFFUSE);
    EXPECT_EQ(red.color[0], 0.5f);
    EXPECT_EQ(scene->shapes[0].material, 0u);
    EXPECT_FALSE(scene->shapes[1].area_light);
    ASSERT_TRUE(scene->shapes[2].area_light);
    EXPECT_EQ(scene->area_lights[*scene->shapes[2].area_light].radiance, (Float3{3, 2, 1}));
    EXPECT_NE(scene->shapes[1].mesh->name(), scene->shapes[2].mesh->name());
    EXPECT_EQ(scene->files, std::vector<std::string>{(folder / "my colours.mtl").string()});
}

TEST(ImportObjMaterials, NamesWithoutAnyLibraryAreSaid) {
    const TemporaryFolder folder;
    const auto scene = import_scene({folder.write("a.obj", "usemtl red\n" + two_triangles + "f 1 2 3\nf 2 4 3\n")});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    ASSERT_EQ(scene->warnings.size(), 1u) << joined(scene->warnings);
    EXPECT_NE(scene->warnings[0].find("material \"red\" is in no library"), std::string::npos) << scene->warnings[0];
}

TEST(ImportObjMaterials, OfOneMaterialThroughout) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl m\nKd 0.25 0.5 0.75\n");
    const auto scene = import_scene({folder.write("a.obj", "mtllib a.mtl\nusemtl m\n" + two_triangles + "f 1 2 3\nf 2 4 3\n")});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    ASSERT_EQ(scene->shapes.size(), 2u);
    EXPECT_EQ(scene->materials[scene->shapes[0].material].color[2], 0.75f);
}

// As 3ds Max writes them.
TEST(ImportObjMaterials, NamesMayHoldTheSignOfComments) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl Material #25\nKd 0.25 0 0\nnewmtl Material #26 # of the roof\nKd 0.5 0 0\nnewmtl b\nKd 0.75 0 0\n");
    const auto scene = import_scene({folder.write(
        "a.obj", "mtllib a.mtl # all\n" + two_triangles + "usemtl Material #25\nf 1 2 3\nusemtl Material #26\nf 1 2 3\nusemtl b #1\nf 2 4 3\n")});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_TRUE(scene->warnings.empty()) << joined(scene->warnings);
    ASSERT_EQ(scene->shapes.size(), 4u);
    for (size_t i = 0; i < 3; ++i) EXPECT_EQ(scene->materials[scene->shapes[i].material].color[0], 0.25f * static_cast<float>(i + 1)) << i;
}

TEST(ImportObjMaterials, ALibraryIsReadOnceWhateverItIsCalled) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl a\nKd 0.25 0.5 0.75\n");
    const auto scene =
        import_scene({folder.write("a.obj", "mtllib a.mtl\nmtllib ./a.mtl\nmtllib ././a.mtl\nusemtl a\n" + two_triangles + "f 1 2 3\n")});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_EQ(scene->files.size(), 1u);
}

// In time that grows with their number, not with its square: this takes a second at most, and would take minutes.
TEST(ImportObjMaterials, ManyMaterials) {
    const TemporaryFolder folder;
    constexpr int count = 100000;
    std::string library, model = "mtllib a.mtl\n" + two_triangles;
    for (int i = 0; i < count; ++i) {
        library += "newmtl m" + std::to_string(i) + "\nKd 0.5 0.5 0.5\n";
        model += "v " + std::to_string(i) + " 5 5\nusemtl m" + std::to_string(i) + "\nf 1 2 -1\n";
    }
    folder.write("a.mtl", library);
    const auto begin = std::chrono::steady_clock::now();
    const auto scene = import_scene({folder.write("a.obj", model)});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    ASSERT_EQ(scene->shapes.size(), count + 1u);
    uint64_t triangles = 0;
    for (int i = 0; i < count; ++i) {
        TriangleMesh mesh;
        MeshIssues issues;
        ASSERT_TRUE(scene->shapes[static_cast<size_t>(i)].mesh->load(mesh, issues).ok());
        ASSERT_EQ(mesh.positions.size(), 3u);
        triangles += mesh.triangles.size();
    }
    EXPECT_EQ(triangles, uint64_t{count});
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST(ImportObjMaterials, WhatIsMissingIsSaidOnce) {
    const TemporaryFolder folder;
    const auto missing = import_scene({folder.write("a.obj", "mtllib none.mtl\nusemtl a\n" + two_triangles + "f 1 2 3\nusemtl b\nf 2 4 3\n")});
    ASSERT_TRUE(missing.ok()) << missing.status().message();
    ASSERT_EQ(missing->warnings.size(), 1u) << joined(missing->warnings);
    EXPECT_NE(missing->warnings[0].find("none.mtl cannot be found"), std::string::npos) << missing->warnings[0];
    folder.write("b.mtl", "newmtl a\nKd 1 1 1\n");
    const auto unknown = import_scene({folder.write("b.obj", "mtllib b.mtl\nusemtl a\n" + two_triangles + "f 1 2 3\nusemtl b\nf 2 4 3\n")});
    ASSERT_TRUE(unknown.ok());
    ASSERT_EQ(unknown->warnings.size(), 1u) << joined(unknown->warnings);
    EXPECT_NE(unknown->warnings[0].find("material \"b\" is in none of its libraries"), std::string::npos) << unknown->warnings[0];
    folder.write("c.mtl", "newmtl a\nKd 0.1 0.2\nmap_Kd bricks.png\nbump dents.png\nnonsense\nNs x\n");
    const auto odd = import_scene({folder.write("c.obj", "mtllib c.mtl\nusemtl a\n" + two_triangles + "f 1 2 3\n")});
    ASSERT_TRUE(odd.ok());
    ASSERT_EQ(odd->warnings.size(), 2u) << joined(odd->warnings);
    EXPECT_NE(odd->warnings[0].find("c.mtl:6: \"Ns\" cannot be understood; 1 such line is skipped"), std::string::npos) << odd->warnings[0];
    EXPECT_NE(odd->warnings[1].find("image maps are left out: 2 cannot be found, e.g. bricks.png"), std::string::npos) << odd->warnings[1];
}

// Exporters write normal maps as bump maps. Heights in unknown units are left out.
TEST(ImportObjMaterials, BumpMapsThatAreOfNormalsTurnThem) {
    const auto parameters = [](const std::string& statement, const std::string& pixels) {
        const TemporaryFolder folder;
        folder.write("a.ppm", "P6 2 1 255\n" + pixels + pixels);
        folder.write("a.mtl", "newmtl m\nKd 1 1 1\n" + statement + " a.ppm\n");
        const ObjLibraries libraries = read_obj_libraries(folder / "a.obj", {"a.mtl"});
        std::string found = std::to_string(libraries.warnings.size());
        for (const auto& p : engine_material(libraries.materials.at(0)).textures) found += p.parameter == RP_PARAMETER_NORMAL ? " normal" : " other";
        return found;
    };
    const std::string flat = "\x80\x80\xff", grey = "\xc0\xc0\xc0", dim = "\x40\x40\xff";
    EXPECT_EQ(parameters("map_Bump -bm 0.3", flat), "0 normal");
    EXPECT_EQ(parameters("bump", flat), "0 normal");
    EXPECT_EQ(parameters("norm", dim), "0 normal");
    EXPECT_EQ(parameters("map_bump", grey), "1");
    EXPECT_EQ(parameters("map_bump", dim), "1");
    EXPECT_EQ(parameters("disp", flat), "1");
}

ObjMaterial material(const std::string& text) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl m\n" + text);
    const ObjLibraries libraries = read_obj_libraries(folder / "a.obj", {"a.mtl"});
    return libraries.materials.empty() ? ObjMaterial() : libraries.materials[0];
}

TEST(ImportObjMaterials, BecomeWhatTheEngineHas) {
    const auto kind = [](const std::string& text) { return engine_material(material(text)).material.kind; };
    EXPECT_EQ(kind("Kd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nNs 250\nillum 1\n"), RP_MATERIAL_DIFFUSE);
    const rp_material gloss = engine_material(material("Kd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nNs 198\nillum 2\n")).material;
    EXPECT_EQ(gloss.kind, RP_MATERIAL_LAYERED);
    EXPECT_FLOAT_EQ(gloss.specular[0], 0.04f);
    EXPECT_FLOAT_EQ(gloss.alpha, 0.1f);
    const rp_material veil = engine_material(material("Kd 0.8 0.4 0.2\nd 0.25\n")).material;
    EXPECT_FLOAT_EQ(veil.refracted[0], 0.75f);
    EXPECT_FLOAT_EQ(veil.color[0], 0.2f);
    EXPECT_EQ(kind("Kd 0 0 0\nKs 0.9 0.9 0.9\nNs 500\nillum 3\n"), RP_MATERIAL_CONDUCTOR);
    EXPECT_EQ(kind("Kd 0.8 0.2 0.2\nKs 0.9 0.9 0.9\nNs 500\nillum 3\n"), RP_MATERIAL_LAYERED);
    EXPECT_EQ(kind("Kd 1 1 1\nd 0.1\nNi 1.45\nillum 4\n"), RP_MATERIAL_DIELECTRIC);
    EXPECT_EQ(kind("Kd 1 1 1\nTr 0.9\nNi 1.3\n"), RP_MATERIAL_DIELECTRIC);
    EXPECT_EQ(kind("Kd 1 1 1\nd 0.5\nNi 1\nillum 2\n"), RP_MATERIAL_LAYERED);
    EXPECT_EQ(kind("Kd 0.9 0.6 0.3\nPm 1\nPr 0.3\n"), RP_MATERIAL_CONDUCTOR);
    EXPECT_FLOAT_EQ(engine_material(material("Kd 1 1 1\nd 0.1\nNi 1.45\nillum 4\n")).material.ior, 1.45f);
    // alpha^2 = 2 / (Ns + 2)
    EXPECT_FLOAT_EQ(engine_material(material("Kd 0 0 0\nKs 1 1 1\nNs 48\nillum 3\n")).material.alpha, 0.2f);
    EXPECT_EQ(engine_material(material("Kd 0 0 0\nmap_Kd a.png\n")).material.color[0], 0.5f);
    EXPECT_EQ(engine_material(material("Kd 0.3 0.3 0.3\nmap_Kd a.png\n")).material.color[0], 0.3f);
    EXPECT_FALSE(emitted_radiance(material("Kd 1 1 1\nKe 0 0 0\n")));
}

TEST(ImportObjMaterials, CapitalsOfKeywordsDoNotMatter) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "NEWMTL red\nkd 0.5 0.1 0.1\n");
    const ObjLibraries found = read_obj_libraries(folder.write("a.obj", ""), {"a.mtl"});
    ASSERT_EQ(found.materials.size(), 1u);
    ASSERT_TRUE(found.materials[0].diffuse);
    EXPECT_EQ(found.materials[0].diffuse->x, 0.5f);
}

}  // namespace
}  // namespace raypager
