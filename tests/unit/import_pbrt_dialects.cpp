// pbrt scenes as they are found: of version 3, with what pbrt takes with a warning, and with what exporters write.
#include <gtest/gtest.h>

#include <cmath>

#include "unit/import_files.hpp"
#include "unit/pbrt_fixture.hpp"

namespace raypager {
namespace {

using ImportPbrtDialects = test::PbrtTest;
using test::one_triangle;

constexpr const char* ball = " Shape \"sphere\" ";

const rp_material& material_of(const Scene& s, size_t shape = 0) { return s.materials[s.shapes.at(shape).material]; }

TEST_F(ImportPbrtDialects, MarksLineEndsAndCommas) {
    expect_silence("\xef\xbb\xbfWorldBegin LightSource \"infinite\" \"rgb L\" [1, 2 ,3]" + std::string(ball));
    const Scene s = expect_silence("LookAt 0, 0, 5, 0, 0, 0, 0, 1, 0 Camera \"perspective\" WorldBegin LightSource \"infinite\" \"rgb L\" [1, 2,3]" +
                                   std::string(ball));
    EXPECT_EQ(s.lights[0].radiance[2], 3);
    EXPECT_EQ(s.camera.eye.z, 5);
    // Lines are counted whatever ends them, and comments end with them.
    expect_error("# a\rWorldBegin\r\rShape sphere", "scene.pbrt:4:7: ");
    expect_error("# a\r\nWorldBegin\r\n\r\nShape sphere", "scene.pbrt:4:7: ");
    expect_error("# a\nWorldBegin\n\nShape sphere", "scene.pbrt:4:7: ");
    expect_warning("WorldBegin NamedMaterial \"Grün 緑\"" + std::string(ball), "there is no material \"Grün 緑\"");
    expect_warning("WorldBegin NamedMaterial \"a\xff\"" + std::string(ball), "there is no material \"a?\"");
}

TEST_F(ImportPbrtDialects, WhatIsMissingIsLeftOut) {
    EXPECT_EQ(expect_warning("WorldBegin\nShape \"plymesh\" \"string filename\" \"absent.ply\"" + std::string(ball),
                             "scene.pbrt:2: the file \"absent.ply\" is not there; its shape is left out")
                  .shapes.size(),
              1u);
    expect_error("WorldBegin\nShape \"plymesh\" \"string filename\" \"absent.ply\"", "scene.pbrt:2: the file \"absent.ply\" is not there");
    expect_error("WorldBegin\nShape \"objmesh\" \"string filename\" \"a.obj\"", "scene.pbrt:2: Shape \"objmesh\" is not supported");
    const Scene red = expect_warning("WorldBegin Material \"diffuse\" \"rgb reflectance\" [1 0 0] NamedMaterial \"x\"" + std::string(ball),
                                     "there is no material \"x\"; what is in force stays");
    EXPECT_EQ(material_of(red).color[1], 0);
    EXPECT_EQ(expect_warning("WorldBegin ObjectInstance \"x\"" + std::string(ball), "there is no object \"x\"").shapes.size(), 1u);
    expect_error("WorldBegin\nObjectBegin \"x\" Shape \"sphere\"\nObjectInstance \"x\" ObjectEnd ObjectInstance \"x\"",
                 "ObjectInstance: object \"x\" in itself");
    expect_warning("WorldBegin CoordSysTransform \"x\"" + std::string(ball), "there is no coordinate system \"x\"");
    expect_warning("WorldBegin Material \"matte\" \"spectrum Kd\" \"absent.spd\"" + std::string(ball), "\"absent.spd\" is neither known nor a file");
    expect_warning("WorldBegin AreaLightSource \"glow\"" + std::string(ball), "its shapes do not shine");
    folder.write("empty.pbrt", "");
    EXPECT_EQ(expect_silence("WorldBegin Include \"empty.pbrt\"" + std::string(ball)).shapes.size(), 1u);
    expect_error("WorldBegin\nInclude \"absent.pbrt\"" + std::string(ball), "scene.pbrt:2: ");
}

TEST_F(ImportPbrtDialects, EmptyAndOddMeshes) {
    const std::string mesh = "WorldBegin Shape \"trianglemesh\" ";
    EXPECT_EQ(expect_warning(mesh + "\"point P\" [ ] \"normal N\" [ ] \"integer indices\" [ ]" + ball, "left out").shapes.size(), 1u);
    EXPECT_EQ(expect_warning(mesh + "\"integer indices\" [0 1 2]" + ball, "left out").shapes.size(), 1u);
    EXPECT_EQ(expect_warning("WorldBegin Shape \"sphere\" \"float radius\" 0" + std::string(ball), "radius 0").shapes.size(), 1u);
    folder.write("empty.ply", "");
    folder.write("none.ply", test::to_ply_binary({}));
    for (const char* name : {"empty.ply", "none.ply"}) {
        const std::string shape = "WorldBegin Shape \"plymesh\" \"string filename\" \"" + std::string(name) + "\"";
        EXPECT_EQ(expect_warning(shape + ball, "has no vertices or no faces").shapes.size(), 1u) << name;
    }
    const std::string points = "\"point P\" [0 0 0 1 0 0 0 1 0 9 9] ";
    const Scene s = expect_warning(mesh + points + "\"float indices\" [0 1 2 0]" + ball, "the last 2 of 11 are ignored");
    ASSERT_EQ(s.shapes.size(), 2u);
    TriangleMesh loaded;
    MeshIssues issues;
    ASSERT_TRUE(s.shapes[0].mesh->load(loaded, issues).ok());
    EXPECT_EQ(loaded.triangles.size(), 1u);
    expect_warning(mesh + "\"point P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 1]" + ball, "1 normals for 3 points; they are ignored");
}

TEST_F(ImportPbrtDialects, WorldBeginIsNeeded) {
    expect_error(one_triangle, "scene.pbrt: has no WorldBegin");
    const Scene s =
        expect_warning(one_triangle + "WorldBegin" + std::string(ball), "scene.pbrt:1: Shape \"trianglemesh\" before WorldBegin is left out");
    EXPECT_EQ(s.shapes.size(), 1u);
    expect_error("WorldBegin", "scene.pbrt: has no shape");
}

// pbrt-v3 keeps attributes and objects on one stack, and transforms on another.
TEST_F(ImportPbrtDialects, NestingAsInVersion3) {
    const std::string body = R"(WorldBegin
AttributeBegin
  Translate 1 0 0
  ObjectBegin "o"
    AttributeBegin Translate 0 1 0 Shape "sphere" AttributeEnd
AttributeEnd
ObjectEnd
Translate 0 0 1
ObjectInstance "o"
)";
    const Scene version_3 = expect_silence("Film \"image\" " + body + "WorldEnd");
    const Scene version_4 = expect_warning("Film \"rgb\" " + body,
                                           "scene.pbrt:6: AttributeEnd before the end of the ObjectBegin in line 4; it is taken as pbrt-v3 would");
    for (const Scene& s : {version_3, version_4}) {
        ASSERT_EQ(s.shapes.size(), 1u);
        EXPECT_EQ(s.shapes[0].to_world.point(0, 0, 0), (std::array<double, 3>{1, 1, 1}));
    }
    // The attribute's end brings back the transform that was saved last, the transform's end what was saved first.
    const Scene crossed = scene(R"(WorldBegin
AttributeBegin Translate 1 0 0 Material "matte" "rgb Kd" [1 0 0] TransformBegin Translate 0 1 0
AttributeEnd
Shape "sphere"
TransformEnd
Shape "sphere"
WorldEnd)");
    ASSERT_EQ(crossed.shapes.size(), 2u);
    EXPECT_EQ(crossed.shapes[0].to_world.point(0, 0, 0), (std::array<double, 3>{1, 0, 0}));
    EXPECT_EQ(crossed.shapes[0].material, 0u);
    EXPECT_EQ(crossed.shapes[1].to_world.point(0, 0, 0), (std::array<double, 3>{0, 0, 0}));
    // Version 4 takes TransformBegin for AttributeBegin.
    const std::string kept = "TransformBegin Translate 1 0 0 AttributeBegin TransformEnd AttributeEnd TransformBegin Material ";
    const Scene red_3 = expect_silence("WorldBegin " + kept + "\"matte\" \"rgb Kd\" [1 0 0] TransformEnd" + ball);
    const Scene grey_4 = expect_silence("WorldBegin " + kept + "\"diffuse\" \"rgb reflectance\" [1 0 0] TransformEnd" + ball);
    EXPECT_EQ(material_of(red_3).color[1], 0);
    EXPECT_EQ(material_of(grey_4).color[1], 0.5f);
    EXPECT_EQ(grey_4.shapes[0].to_world.point(0, 0, 0)[0], 0);
    expect_warning("WorldBegin\nAttributeEnd" + std::string(ball), "scene.pbrt:2: AttributeEnd without a beginning is ignored");
    expect_warning("WorldBegin\nTransformEnd" + std::string(ball), "scene.pbrt:2: TransformEnd without a beginning is ignored");
    expect_warning("WorldBegin\nAttributeBegin" + std::string(ball) + "WorldEnd", "scene.pbrt:2: AttributeBegin without AttributeEnd");
    expect_error("WorldBegin\nAttributeBegin" + std::string(ball), "scene.pbrt:2: AttributeBegin without AttributeEnd; the file is truncated");
}

TEST_F(ImportPbrtDialects, TexturesAreTheNumbersThatTheyAre) {
    const Scene s = expect_silence(R"(WorldBegin
Texture "a" "spectrum" "constant" "rgb value" [.8 .1 .1]
Texture "a" "float" "constant" "float value" .04
Texture "down" "float" "scale" "float tex1" [-1] "texture tex2" "a"
Texture "b" "color" "mix" "rgb tex1" [0 .5 1] "texture tex2" "a" "float amount" .25
Material "matte" "texture Kd" "a" "texture bumpmap" "down"
Shape "sphere"
Material "conductor" "texture roughness" "a" "rgb reflectance" [1 1 1]
Shape "sphere"
Texture "index" "float" "constant" "float value" 1.7
Material "glass" "texture eta" "index"
Shape "sphere"
Material "matte" "texture Kd" "b"
Shape "sphere"
)" + std::string("#"));
    EXPECT_FLOAT_EQ(material_of(s, 0).color[0], 0.8f);
    EXPECT_FLOAT_EQ(material_of(s, 1).alpha, 0.2f);
    EXPECT_FLOAT_EQ(material_of(s, 2).ior, 1.7f);
    EXPECT_FLOAT_EQ(material_of(s, 3).color[0], 0.2f);
    EXPECT_FLOAT_EQ(material_of(s, 3).color[1], 0.4f);
}

TEST_F(ImportPbrtDialects, TexturesThatAreNotThere) {
    const Scene s = expect_warning("WorldBegin Texture \"a\" \"float\" \"constant\" Material \"matte\" \"texture Kd\" \"a\"" + std::string(ball),
                                   "there is no spectrum texture \"a\"; \"Kd\" stays at its default");
    EXPECT_EQ(material_of(s).color[0], 0.5f);
    expect_warning("WorldBegin Material \"matte\" \"texture sigma\" \"a\"" + std::string(ball), "there is no float texture \"a\"");
    expect_warning("WorldBegin Texture \"a\" \"vector\" \"constant\"" + std::string(ball), "which is neither float nor spectrum");
    expect_error("WorldBegin Texture \"a\" \"spectrum\" \"constant\" \"rgb value\" [-1 0 0]" + std::string(ball), "0 or more");
    expect_warning("WorldBegin Material \"matte\" \"texture bumpmap\" \"a\"" + std::string(ball), "there is no float texture \"a\"");
}

TEST_F(ImportPbrtDialects, RoughnessAsEachVersionMapsIt) {
    const auto alpha = [&](const std::string& material) { return material_of(expect_silence("WorldBegin Material " + material + ball)).alpha; };
    EXPECT_NEAR(alpha("\"metal\" \"float roughness\" .01"), 0.13892, 1e-5);
    EXPECT_NEAR(alpha("\"metal\""), 0.13892, 1e-5);
    EXPECT_NEAR(alpha("\"metal\" \"float roughness\" 0"), 0.04727, 1e-5) << "that of 0.001";
    EXPECT_FLOAT_EQ(alpha("\"metal\" \"float roughness\" .1 \"string remaproughness\" \"false\""), 0.1f);
    EXPECT_FLOAT_EQ(alpha("\"conductor\" \"float roughness\" .01"), 0.1f);
    EXPECT_FLOAT_EQ(alpha("\"metal\" \"float uroughness\" .1 \"float vroughness\" .1 \"bool remaproughness\" [\"false\"]"), 0.1f);
}

TEST_F(ImportPbrtDialects, ColoursComeFromTheRightParameter) {
    const auto color = [&](const std::string& material) { return material_of(scene("WorldBegin " + material + ball)).color[0]; };
    EXPECT_FLOAT_EQ(color("Material \"plastic\" \"rgb Ks\" [.9 .9 .9]"), 0.25f);
    EXPECT_FLOAT_EQ(color("Material \"uber\" \"rgb Kd\" [.7 .7 .7] \"rgb Kr\" [.1 .1 .1]"), 0.7f);
    EXPECT_FLOAT_EQ(color("Material \"substrate\""), 0.5f);
    EXPECT_FLOAT_EQ(color("Material \"translucent\" \"rgb Kd\" [.8 .8 .8]"), 0.4f);
    EXPECT_FLOAT_EQ(color("Material \"disney\" \"rgb color\" [.3 .3 .3]"), 0.3f);
    const std::string parts =
        "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [1 1 1] "
        "MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0 0 0] Material \"mix\" ";
    // What the amount is of differs.
    const auto second = [&](const std::string& amount) { return material_of(scene("WorldBegin " + parts + amount + ball)).amount; };
    EXPECT_FLOAT_EQ(second("\"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" [.8 .8 .8]"), 0.2f);
    EXPECT_FLOAT_EQ(second("\"string materials\" [\"a\" \"b\"] \"float amount\" .8"), 0.8f);
}

TEST_F(ImportPbrtDialects, Parameters) {
    const Scene s = expect_warning("Film \"rgb\" \"integer xresolution\" 10 \"float xresolution\" 20 WorldBegin" + std::string(ball),
                                   "parameter \"xresolution\" is given twice; the last one counts");
    EXPECT_EQ(s.width, 20u);
    expect_warning("WorldBegin Shape \"sphere\" \"float radius\" 1 \"float frizz\" 3",
                   "parameter \"frizz\" of Shape \"sphere\" is not known; it is ignored");
    expect_warning("Camera \"perspective\" \"number fov\" 3 WorldBegin" + std::string(ball), "\"number\" is no type of parameter");
    expect_warning("WorldBegin LightSource \"point\" \"rgb I\" [1 2 3 4]" + std::string(ball), "the last 1 of 4 are ignored");
    EXPECT_TRUE(scene("WorldBegin AreaLightSource \"diffuse\" \"string twosided\" \"true\"" + std::string(ball)).area_lights.at(0).two_sided);
    const Scene lamp =
        expect_silence("WorldBegin LightSource \"point\" \"color I\" [1 2 3] \"color scale\" [2 2 2] \"float power\" 12.5663706" + std::string(ball));
    EXPECT_FLOAT_EQ(lamp.lights[0].radiance[2], 6);
}

TEST_F(ImportPbrtDialects, WarningsAreGroupedByKind) {
    std::string text = "WorldBegin\n";
    for (const char* name : {"a", "b", "b", "c", "d", "e"}) text += "NamedMaterial \"" + std::string(name) + "\"\n";
    const Scene s = expect_warning(
        text + ball, "scene.pbrt:2: there is no material \"a\"; what is in force stays (and 5 more of the same: \"b\", \"c\", \"d\", ...)");
    EXPECT_EQ(s.warnings.size(), 2u) << "this, and that there is no light";
}

TEST_F(ImportPbrtDialects, FilesBesideTheSceneComeFirst) {
    std::filesystem::create_directory(folder / "parts");
    folder.write("a.ply", test::to_ply_binary(test::make_box()));
    folder.write("parts/a.ply", test::to_ply_binary(test::make_box()));
    folder.write("parts/b.ply", test::to_ply_binary(test::make_box()));
    folder.write("parts/part.pbrt",
                 "Shape \"plymesh\" \"string filename\" \"a.ply\" Shape \"plymesh\" \"string filename\" \"b.ply\" "
                 "Shape \"plymesh\" \"string filename\" \"b.ply.gz\"");
    const Scene s = scene("WorldBegin Include \"parts/part.pbrt\"");
    ASSERT_EQ(s.shapes.size(), 3u);
    EXPECT_EQ(s.shapes[0].mesh->files(), std::vector<std::string>{(folder / "a.ply").string()});
    EXPECT_EQ(s.shapes[1].mesh->files(), std::vector<std::string>{(folder / "parts/b.ply").string()});
    EXPECT_EQ(s.shapes[2].mesh, s.shapes[1].mesh) << "unpacked beside where it should be packed";
    // Last, the working directory.
    const std::filesystem::path here = std::filesystem::current_path();
    std::filesystem::current_path(folder / "parts");
    const Scene t = scene("WorldBegin Shape \"plymesh\" \"string filename\" \"b.ply\"");
    std::filesystem::current_path(here);
    EXPECT_EQ(t.shapes.size(), 1u);
}

TEST_F(ImportPbrtDialects, SpectrumFiles) {
    folder.write("grey.spd", "# a comment\r\n300 .25 # more\n800 .25\n");
    const Scene s = scene("WorldBegin Material \"matte\" \"spectrum Kd\" \"grey.spd\"" + std::string(ball));
    EXPECT_FLOAT_EQ(material_of(s).color[1], 0.25f);
    EXPECT_EQ(s.files.size(), 2u);
    folder.write("bad.spd", "300 .25\n400 x\n");
    expect_error("WorldBegin Material \"matte\" \"spectrum Kd\" \"bad.spd\"" + std::string(ball), "bad.spd:2: expected a number instead of \"x\"");
}

// A black body of 2800 K shines mostly in the infrared, where version 3 has its 1.
TEST_F(ImportPbrtDialects, BlackBodiesOfBothVersions) {
    const auto luminance = [&](const std::string& values) {
        const Scene s = scene("WorldBegin LightSource \"infinite\" \"blackbody L\" [" + values + "]" + ball);
        const auto& c = s.lights.at(0).radiance;
        return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    };
    EXPECT_NEAR(luminance("2800"), 1, 1e-5);
    EXPECT_NEAR(luminance("5500 2"), 2 * 0.984, 0.02) << "nearly flat in the visible";
    EXPECT_NEAR(luminance("2800 1"), 0.306, 0.02) << "about B(555 nm) / B(1035 nm)";
}

TEST_F(ImportPbrtDialects, FilmOfVersion3) {
    const Scene s = expect_silence(
        "Film \"image\" \"float scale\" 4 \"float maxsampleluminance\" .5 Camera \"perspective\" \"float shutterclose\" .1 WorldBegin" +
        std::string(ball) + "WorldEnd");
    EXPECT_EQ(s.film.exposure, 4) << "the shutter does not matter";
    EXPECT_EQ(s.film.max_luminance, 0.5f);
    EXPECT_EQ(s.film.max_xyz, FilmResponse::no_limit);
    EXPECT_EQ(scene("WorldBegin" + std::string(ball)).film, FilmResponse());
}

TEST_F(ImportPbrtDialects, FilmOfVersion4) {
    const Scene s =
        expect_silence("Film \"rgb\" \"float iso\" 400 \"float maxcomponentvalue\" 20 Camera \"perspective\" \"float shutterclose\" .5 WorldBegin" +
                       std::string(ball));
    EXPECT_EQ(s.film.exposure, 2) << "half a second, four times the speed";
    EXPECT_EQ(s.film.max_xyz, 10);
    expect_warning("Film \"rgb\" \"string sensor\" \"canon_eos_100d\" WorldBegin" + std::string(ball),
                   "the sensor \"canon_eos_100d\" is not supported");
    expect_error("Film \"rgb\" \"float iso\" 0 WorldBegin" + std::string(ball), "must be more than 0");
    expect_error("Film \"rgb\" \"float maxcomponentvalue\" -1 WorldBegin" + std::string(ball), "a limit of samples");
    // It would be 0 in single precision, and so would the picture.
    expect_error("Film \"rgb\" \"float iso\" 1e30 \"float maxcomponentvalue\" 1e-30 WorldBegin" + std::string(ball), "too small to compute with");
    expect_error("Film \"rgb\" \"float whitebalance\" 3 WorldBegin" + std::string(ball), "whitebalance");
}

// White balance turns light of that temperature into white, and leaves that of 6500 K about as it is.
TEST_F(ImportPbrtDialects, WhiteBalance) {
    const auto matrix = [&](const std::string& kelvin) {
        return scene("Film \"rgb\" \"float whitebalance\" " + kelvin + " WorldBegin" + ball).film.color_matrix;
    };
    const auto same = matrix("6504");
    for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(same[i], i % 4 == 0 ? 1 : 0, 2e-3) << "two definitions of D65, in four digits";
    // Chromaticity of CIE illuminant D50, in linear sRGB of luminance 1.
    const double x = 0.34567, y = 0.35850, xyz[3] = {x / y, 1, (1 - x - y) / y};
    const double rgb[3] = {3.2404542 * xyz[0] - 1.5371385 * xyz[1] - 0.4985314 * xyz[2],
                           -0.9692660 * xyz[0] + 1.8760108 * xyz[1] + 0.0415560 * xyz[2],
                           0.0556434 * xyz[0] - 0.2040259 * xyz[1] + 1.0572252 * xyz[2]};
    const auto m = matrix("5000");
    for (size_t row = 0; row < 3; ++row) EXPECT_NEAR(m[3 * row] * rgb[0] + m[3 * row + 1] * rgb[1] + m[3 * row + 2] * rgb[2], 1, 5e-3);
}

}  // namespace
}  // namespace raypager
