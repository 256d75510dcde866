// pbrt scene files: what directives do, what is said about those that do nothing, and how errors name their place.
#include <gtest/gtest.h>

#include <cmath>

#include "import/pbrt_spectra.hpp"
#include "unit/import_files.hpp"
#include "unit/pbrt_fixture.hpp"

namespace raypager {
namespace {

using ImportPbrt = test::PbrtTest;
using test::one_triangle;

void expect_color(const float* color, float r, float g, float b) {
    EXPECT_FLOAT_EQ(color[0], r);
    EXPECT_FLOAT_EQ(color[1], g);
    EXPECT_FLOAT_EQ(color[2], b);
}

TEST_F(ImportPbrt, AWholeScene) {
    folder.write("mesh.ply", test::to_ply_binary(test::make_box()));
    const Scene s = scene(R"(
# a comment with "quotes" and [ brackets
Integrator "volpath" "integer maxdepth" 7
Sampler "zsobol" "integer pixelsamples" [ 32 ]
Film "rgb" "integer xresolution" [400] "integer yresolution" 300 "string filename" "out.exr"
LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 90
WorldBegin
LightSource "infinite" "rgb L" [.1 .2 .3] "float scale" 2
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [5 6 7] "bool twosided" true
  Translate 0 2 0
  Shape "sphere" "float radius" .5
AttributeEnd
MakeNamedMaterial "gold" "string type" "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.25
NamedMaterial "gold"
ReverseOrientation
Scale 2 2 2
Shape "plymesh" "string filename" "mesh.ply"
)" + one_triangle);
    EXPECT_EQ(s.max_depth, 7u);
    EXPECT_EQ(s.spp, 32u);
    EXPECT_EQ(s.width, 400u);
    EXPECT_EQ(s.height, 300u);
    EXPECT_TRUE(s.warnings.empty()) << s.warnings[0];
    ASSERT_EQ(s.files.size(), 1u);

    EXPECT_FLOAT_EQ(s.camera.eye.z, -5);
    EXPECT_FLOAT_EQ(s.camera.forward.z, 1);
    EXPECT_FLOAT_EQ(s.camera.up.y, 1);  // 90 degrees on the shorter side
    EXPECT_FLOAT_EQ(s.camera.right.x, 4.0f / 3);

    ASSERT_EQ(s.lights.size(), 1u);
    EXPECT_EQ(s.lights[0].kind, RP_LIGHT_INFINITE);
    expect_color(s.lights[0].radiance, 0.2f, 0.4f, 0.6f);

    ASSERT_EQ(s.shapes.size(), 3u);
    EXPECT_FALSE(s.shapes[0].mesh);
    EXPECT_FLOAT_EQ(s.shapes[0].sphere.radius, 0.5f);
    EXPECT_EQ(s.shapes[0].to_world.point(0, 0, 0)[1], 2);
    EXPECT_EQ(s.shapes[0].area_light, 0u);
    EXPECT_TRUE(s.area_lights[0].two_sided);
    EXPECT_EQ(s.area_lights[0].radiance, (Float3{5, 6, 7}));
    EXPECT_EQ(s.shapes[0].material, 0u);
    EXPECT_FALSE(s.shapes[0].reverse_orientation);

    const rp_material& gold = s.materials[s.shapes[1].material];
    EXPECT_EQ(gold.kind, RP_MATERIAL_CONDUCTOR);
    EXPECT_FLOAT_EQ(gold.alpha, 0.5f);
    EXPECT_GT(gold.eta[2], gold.eta[0]);
    EXPECT_TRUE(s.shapes[1].reverse_orientation);
    EXPECT_FALSE(s.shapes[1].area_light);
    EXPECT_EQ(s.shapes[1].to_world.m[0][0], 2);
    EXPECT_EQ(s.shapes[1].mesh->files(), std::vector<std::string>{(folder / "mesh.ply").string()});
    TriangleMesh mesh;
    MeshIssues issues;
    ASSERT_TRUE(s.shapes[2].mesh->load(mesh, issues).ok());
    EXPECT_EQ(mesh.triangles.size(), 1u);
    EXPECT_NE(s.shapes[2].name.find("scene.pbrt:20"), std::string::npos) << s.shapes[2].name;
}

TEST_F(ImportPbrt, PortraitPicturesSpanTheWidth) {
    const Scene s = scene(
        "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 200 Scale -1 1 1 Camera \"perspective\" \"float fov\" 90 WorldBegin " +
        one_triangle);
    EXPECT_FLOAT_EQ(s.camera.right.x, -1);  // mirrored by the Scale
    EXPECT_FLOAT_EQ(s.camera.up.y, 2);
}

TEST_F(ImportPbrt, TransformStack) {
    const Scene s = scene(R"(WorldBegin
Translate 1 0 0
CoordinateSystem "there"
TransformBegin
  Rotate 90 0 0 1
  Shape "sphere"
TransformEnd
AttributeBegin
  Transform [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1]
  Shape "sphere"
  ConcatTransform [2 0 0 0 0 2 0 0 0 0 2 0 1 0 0 1]
  Shape "sphere"
  CoordSysTransform "there"
  Shape "sphere"
  Identity
  Shape "sphere"
AttributeEnd
Shape "sphere"
)");
    ASSERT_EQ(s.shapes.size(), 6u);
    const auto at = [&](size_t i, double x, double y, double z) {
        const auto p = s.shapes[i].to_world.point(1, 0, 0);
        EXPECT_NEAR(p[0], x, 1e-12) << "shape " << i;
        EXPECT_NEAR(p[1], y, 1e-12) << "shape " << i;
        EXPECT_NEAR(p[2], z, 1e-12) << "shape " << i;
    };
    at(0, 1, 1, 0);
    at(1, 6, 6, 7);
    at(2, 8, 6, 7);
    at(3, 2, 0, 0);
    at(4, 1, 0, 0);
    at(5, 2, 0, 0);
}

TEST_F(ImportPbrt, Version3Names) {
    const Scene s = scene(R"(
SurfaceIntegrator "path"
WorldBegin
Material "matte" "color Kd" [.1 .2 .3]
Shape "sphere"
Material "mirror" "rgb Kr" [1 1 1]
Shape "sphere"
Material "glass" "float index" 1.33
Shape "sphere"
Material "metal" "spectrum eta" "spds/Cu.eta.spd" "spectrum k" "spds/Cu.k.spd" "float roughness" [.04] "bool remaproughness" ["false"]
Shape "sphere"
LightSource "point" "rgb I" [1 2 3] "rgb scale" [2 2 2] "point from" [1 2 3]
LightSource "distant" "point from" [0 0 0] "point to" [0 0 -4] "rgb L" [1 1 1]
WorldEnd
)");
    ASSERT_EQ(s.shapes.size(), 4u);
    const auto material = [&](size_t i) { return s.materials[s.shapes[i].material]; };
    EXPECT_EQ(material(0).kind, RP_MATERIAL_DIFFUSE);
    expect_color(material(0).color, 0.1f, 0.2f, 0.3f);
    EXPECT_EQ(material(1).kind, RP_MATERIAL_CONDUCTOR);
    EXPECT_EQ(material(1).alpha, 0);
    EXPECT_EQ(material(2).kind, RP_MATERIAL_DIELECTRIC);
    EXPECT_FLOAT_EQ(material(2).ior, 1.33f);
    EXPECT_FLOAT_EQ(material(3).alpha, 0.04f);
    EXPECT_EQ(material(3).eta[0], named_spectrum("metal-Cu-eta")->x);
    ASSERT_EQ(s.lights.size(), 2u);
    EXPECT_EQ(s.lights[0].kind, RP_LIGHT_POINT);
    expect_color(s.lights[0].p, 1, 2, 3);
    expect_color(s.lights[0].radiance, 2, 4, 6);
    EXPECT_EQ(s.lights[1].kind, RP_LIGHT_DISTANT);
    expect_color(s.lights[1].p, 0, 0, 1);  // towards the light
}

TEST_F(ImportPbrt, ConductorReflectanceIsReached) {
    const Scene s = scene("WorldBegin Material \"conductor\" \"rgb reflectance\" [.2 .5 .9] \"float roughness\" 0 Shape \"sphere\"");
    const rp_material& m = s.materials[s.shapes[0].material];
    for (size_t i = 0; i < 3; ++i) {  // Fresnel at normal incidence with eta = 1
        const double k = m.k[i], reflectance = k * k / (4 + k * k);
        EXPECT_NEAR(reflectance, (std::array{0.2, 0.5, 0.9}[i]), 1e-6) << "single precision";
    }
}

TEST_F(ImportPbrt, IncludesCountFromTheIncludingFile) {
    std::filesystem::create_directory(folder / "parts");
    folder.write("parts/one.pbrt", "Translate 1 0 0 Include \"two.pbrt\"\n");
    folder.write("parts/two.pbrt", "Shape \"plymesh\" \"string filename\" \"box.ply\" Import \"three.pbrt\" Shape \"sphere\"\n");
    folder.write("parts/three.pbrt", "Translate 5 0 0 Shape \"sphere\"");
    folder.write("parts/box.ply", test::to_ply_binary(test::make_box()));
    const Scene s = scene("WorldBegin Include \"parts/one.pbrt\" Shape \"plymesh\" \"string filename\" \"parts/../parts/box.ply\"");
    ASSERT_EQ(s.shapes.size(), 4u);
    EXPECT_EQ(s.files.size(), 4u);
    EXPECT_EQ(s.shapes[0].mesh, s.shapes[3].mesh);  // one file, one source
    EXPECT_EQ(s.shapes[1].to_world.point(0, 0, 0)[0], 6);
    EXPECT_EQ(s.shapes[2].to_world.point(0, 0, 0)[0], 1);  // Import leaves no trace
    EXPECT_EQ(s.shapes[3].to_world.point(0, 0, 0)[0], 1);  // Include does
}

TEST_F(ImportPbrt, IncludeErrors) {
    folder.write("self.pbrt", "Include \"scene.pbrt\"");
    expect_error("# one\nInclude \"self.pbrt\"", "includes itself");
    expect_error("Include \"absent.pbrt\"", "scene.pbrt:1: ");
    folder.write("bad.pbrt", "\n\n  Shape sphere");
    expect_error("Include \"bad.pbrt\"", "bad.pbrt:3:9: expected a string");
    for (int i = 0; i < 300; ++i) folder.write("n" + std::to_string(i) + ".pbrt", "Include \"n" + std::to_string(i + 1) + ".pbrt\"");
    folder.write("n300.pbrt", "Shape \"sphere\"");
    expect_error("Include \"n0.pbrt\"", "256 deep");
}

TEST_F(ImportPbrt, InstancesPlaceShapesAgain) {
    const Scene s = scene(R"(WorldBegin
ObjectBegin "thing"
  Translate 1 0 0
  Shape "sphere"
  Material "dielectric"
)" + one_triangle + R"(ObjectEnd
Translate 0 1 0
ObjectInstance "thing"
Scale 1 1 3
ObjectInstance "thing"
)");
    ASSERT_EQ(s.shapes.size(), 4u);
    EXPECT_EQ(s.shapes[0].to_world.point(0, 0, 0), (std::array<double, 3>{1, 1, 0}));
    EXPECT_FALSE(s.shapes[0].mesh);
    EXPECT_TRUE(s.shapes[2].mesh) << "stretched, so no sphere any more";
    EXPECT_EQ(s.shapes[1].mesh, s.shapes[3].mesh);
    EXPECT_EQ(s.materials[s.shapes[3].material].kind, RP_MATERIAL_DIELECTRIC);
    expect_error("WorldBegin ObjectInstance \"x\"", "there is no object \"x\"");
    expect_error("WorldBegin ObjectBegin \"x\" AttributeEnd", "ObjectBegin without ObjectEnd");
    expect_error("WorldBegin ObjectBegin \"x\" Shape \"sphere\"", "ObjectBegin without ObjectEnd");
}

// The mesh of a shape, with its extent.
struct Extent {
    size_t triangles = 0;
    Float3 lower{1e9f, 1e9f, 1e9f}, upper{-1e9f, -1e9f, -1e9f};
};

Extent extent(const Shape& shape) {
    Extent e;
    TriangleMesh mesh;
    MeshIssues issues;
    if (!shape.mesh || !shape.mesh->load(mesh, issues).ok()) return e;
    EXPECT_FALSE(issues.any()) << issues.describe();
    e.triangles = mesh.triangles.size();
    for (const Float3& p : mesh.positions) {
        e.lower = {std::min(e.lower.x, p.x), std::min(e.lower.y, p.y), std::min(e.lower.z, p.z)};
        e.upper = {std::max(e.upper.x, p.x), std::max(e.upper.y, p.y), std::max(e.upper.z, p.z)};
    }
    // All tessellations here have normals that agree with their triangles' orientation.
    for (const Triangle& t : mesh.triangles) {
        const Float3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]], n = mesh.normals.at(t[0]);
        const Float3 u{b.x - a.x, b.y - a.y, b.z - a.z}, v{c.x - a.x, c.y - a.y, c.z - a.z};
        EXPECT_GT((u.y * v.z - u.z * v.y) * n.x + (u.z * v.x - u.x * v.z) * n.y + (u.x * v.y - u.y * v.x) * n.z, 0);
    }
    return e;
}

TEST_F(ImportPbrt, CurvedShapesBecomeMeshes) {
    const Scene s = scene(R"(WorldBegin
AttributeBegin Scale 1 1 2 Shape "sphere" "float radius" 3 AttributeEnd
Shape "disk" "float radius" 2 "float height" 1
Shape "disk" "float radius" 2 "float innerradius" 1 "float phimax" 90
Shape "cylinder" "float radius" 2 "float zmin" -3 "float zmax" 4
)");
    ASSERT_EQ(s.shapes.size(), 4u);
    const Extent ball = extent(s.shapes[0]), disk = extent(s.shapes[1]), quarter = extent(s.shapes[2]), cylinder = extent(s.shapes[3]);
    EXPECT_EQ(ball.triangles, 65024u);
    EXPECT_EQ(ball.upper, (Float3{1, 1, 1}));
    EXPECT_EQ(s.shapes[0].to_world.point(1, 1, 1), (std::array<double, 3>{3, 3, 6}));
    EXPECT_EQ(disk.triangles, 256u);
    EXPECT_EQ(disk.lower.z, 1);
    EXPECT_EQ(disk.upper.x, 2);
    EXPECT_EQ(quarter.triangles, 512u);
    EXPECT_NEAR(quarter.lower.x, 0, 1e-6);
    EXPECT_EQ(cylinder.lower.z, -3);
    EXPECT_EQ(cylinder.upper.z, 4);
    EXPECT_EQ(s.warnings.size(), 1u) << "no light";
}

TEST_F(ImportPbrt, ShapesThatOnlyPbrtHas) {
    const Scene s = expect_silence(R"(WorldBegin
Shape "sphere" "float radius" 2 "float zmin" 0 "float phimax" 180
Shape "cone" "float radius" 2 "float height" 5
Shape "paraboloid" "float radius" 2 "float zmin" 0 "float zmax" 3
Shape "hyperboloid" "point p1" [1 0 0] "point p2" [1 1 2]
Shape "loopsubdiv" "integer levels" 2 "point3 P" [0 0 0 1 0 0 0 1 0 0 0 1] "integer indices" [0 2 1 0 1 3 1 2 3 0 3 2]
Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 1]
Shape "curve" "string type" "cylinder" "point3 P" [0 0 0 1 0 0 2 0 0 3 0 0] "float width0" .2 "float width1" .1
Shape "curve" "string basis" "bspline" "point3 P" [0 0 0 1 0 0 2 0 0 3 0 0 4 0 0]
Shape "curve" "string type" "ribbon" "point3 P" [0 0 0 1 0 0 2 0 0 3 0 0] "normal3 N" [0 0 1 0 1 0]
Shape "curve" "integer degree" 2 "point3 P" [0 0 0 1 1 0 2 0 0]
)");
    ASSERT_EQ(s.shapes.size(), 10u);
    const Extent half = extent(s.shapes[0]), cone = extent(s.shapes[1]), bowl = extent(s.shapes[2]), hyperboloid = extent(s.shapes[3]);
    EXPECT_EQ(half.upper, (Float3{2, 2, 2}));
    EXPECT_NEAR(half.lower.z, 0, 1e-6);
    EXPECT_NEAR(half.lower.y, 0, 1e-6);
    EXPECT_EQ(cone.upper, (Float3{2, 2, 5}));
    EXPECT_EQ(cone.triangles, 256u);
    EXPECT_EQ(bowl.upper, (Float3{2, 2, 3}));
    EXPECT_EQ(bowl.lower.z, 0);
    EXPECT_NEAR(hyperboloid.upper.x, std::sqrt(2), 1e-3);
    EXPECT_EQ(extent(s.shapes[4]).triangles, 64u);
    EXPECT_GT(extent(s.shapes[5]).triangles, 100u);
    EXPECT_NEAR(extent(s.shapes[6]).upper.x, 3, 1e-6);
    EXPECT_NEAR(extent(s.shapes[7]).upper.x, 3, 1e-6);
    EXPECT_NEAR(extent(s.shapes[7]).lower.x, 1, 1e-6);
    EXPECT_GT(extent(s.shapes[8]).triangles, 2u);
    EXPECT_GT(extent(s.shapes[9]).upper.y, 0.5f);
}

TEST_F(ImportPbrt, ShapesThatAreNone) {
    expect_warning("WorldBegin Shape \"loopsubdiv\" \"integer nlevels\" 9 \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]",
                   "is subdivided 6 times instead of 9");
    expect_warning("WorldBegin " + one_triangle + "Shape \"loopsubdiv\"", "without vertices or triangles");
    expect_warning("WorldBegin " + one_triangle + "Shape \"curve\" \"point3 P\" [1 1 1 1 1 1 1 1 1 1 1 1]", "a curve without length is left out");
    for (const char* shape :
         {"\"sphere\" \"float phimax\" 0", "\"sphere\" \"float zmin\" 2", "\"cone\" \"float height\" 0", "\"paraboloid\" \"float zmin\" -1",
          "\"paraboloid\" \"float zmax\" 0", "\"hyperboloid\" \"point3 p2\" [0 0 1]", "\"hyperboloid\" \"point3 p2\" [0 0 0]",
          "\"cylinder\" \"float radius\" 0", "\"curve\"", "\"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0]", "\"curve\" \"string type\" \"thick\"",
          "\"curve\" \"string basis\" \"nurbs\"", "\"curve\" \"integer degree\" 1", "\"curve\" \"float width\" 0", "\"disk\" \"float innerradius\" 2",
          "\"curve\" \"string type\" \"ribbon\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]"})
        expect_error("WorldBegin\nShape " + std::string(shape), "scene.pbrt:2:1: Shape: ");
}

TEST_F(ImportPbrt, UnsupportedThingsWarnOnceWithTheirPlace) {
    expect_warning("WorldBegin\nFrobnicate 1 [2 3] \"x\" true \"float y\" 1\n" + one_triangle,
                   "scene.pbrt:2: Frobnicate is not supported; it and its parameters are skipped");
    expect_warning("PixelFilter \"nonesuch\" WorldBegin " + one_triangle,
                   "scene.pbrt:1: PixelFilter \"nonesuch\" is not supported; pixels are averaged with a box filter");
    expect_warning("WorldBegin\nMaterial \"hair\" \"rgb reflectance\" [.1 .2 .3]\n" + one_triangle,
                   "scene.pbrt:2: Material \"hair\" is not supported");
    expect_warning("WorldBegin\n\nShape \"nurbs\" \"point3 P\" [0 0 0]\n" + one_triangle,
                   "scene.pbrt:3: Shape \"nurbs\" is not supported; it is left out");
    expect_error("WorldBegin LightSource \"infinite\" \"string filename\" \"sky.exr\"\n" + one_triangle, "sky.exr");
    expect_warning("WorldBegin LightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0 1 0]\n" + one_triangle,
                   "parameter \"portal\" is not supported; light comes from everywhere");
    expect_warning("WorldBegin\nTexture \"t\" \"spectrum\" \"weave\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\" " + one_triangle,
                   "scene.pbrt:2: Texture \"weave\" is not supported for \"reflectance\"; one mid value is used");
    expect_silence("WorldBegin Texture \"unused\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\"\n" + one_triangle);
    expect_warning("WorldBegin LightSource \"point\" \"blackbody I\" 3000\n" + one_triangle, "approximated");
    expect_warning("WorldBegin " + one_triangle + "Scale 0 1 1 " + one_triangle, "left out");
    expect_warning("WorldBegin\nShape \"nurbs\" Shape \"nurbs\"\nShape \"nurbs\" " + one_triangle,
                   "scene.pbrt:2: Shape \"nurbs\" is not supported; it is left out (and 2 more of the same)");
    expect_warning("WorldBegin " + one_triangle, "there is no light");
    expect_warning("WorldBegin " + one_triangle + " AreaLightSource \"diffuse\" Shape \"nonesuch\"", "there is no light");
    expect_error("WorldBegin LightSource \"point\"", "scene.pbrt: has no shape");
}

TEST_F(ImportPbrt, TexturesBecomeColours) {
    const Scene s = scene(R"(WorldBegin
Texture "red" "spectrum" "constant" "rgb value" [.8 .1 .1]
Texture "dark red" "spectrum" "scale" "texture tex" "red" "float scale" .5
Texture "check" "spectrum" "checkerboard" "texture tex1" "red" "rgb tex2" [0 .1 .5]
Material "diffuse" "texture reflectance" "dark red"
Shape "sphere"
Material "diffuse" "texture reflectance" "check"
Shape "sphere"
)");
    expect_color(s.materials[s.shapes[0].material].color, 0.4f, 0.05f, 0.05f);
    expect_color(s.materials[s.shapes[1].material].color, 0.4f, 0.1f, 0.3f);
    expect_warning("WorldBegin Material \"diffuse\" \"texture reflectance\" \"absent\" Shape \"sphere\"", "there is no spectrum texture \"absent\"");
}

TEST_F(ImportPbrt, InfiniteLightsAddUp) {
    const Scene s = scene("WorldBegin LightSource \"infinite\" \"rgb L\" [1 2 3] LightSource \"infinite\" \"float scale\" .5 " + one_triangle);
    ASSERT_EQ(s.lights.size(), 1u);
    expect_color(s.lights[0].radiance, 1.5f, 2.5f, 3.5f);
}

TEST_F(ImportPbrt, SyntaxErrorsNameLineAndColumn) {
    expect_error("WorldBegin\n  [1 2", "scene.pbrt:2:3: expected a directive instead of [");
    expect_error("Translate 1 two 3", "scene.pbrt:1:13: expected number 2 of 3 instead of two");
    expect_error("Translate 1 2", "scene.pbrt:1:14: expected number 3 of 3 instead of the end of the file");
    expect_error("Camera \"perspective", "scene.pbrt:1:8: expected a closing quote");
    expect_error("Camera \"perspective\nWorldBegin", "scene.pbrt:1:8: expected a closing quote");
    expect_error("Camera \"perspective\" \"fov\" 3", "scene.pbrt:1:22: expected \"type name\"");
    expect_error("Camera \"perspective\" \"float fov\" [ 3", "expected a number for \"float fov\" instead of the end of the file");
    expect_error("Camera \"perspective\" \"float fov\" \"3\"", "expected a number for \"float fov\" instead of the string");
    expect_error("Camera \"perspective\" \"float fov\" [3 4]", "scene.pbrt:1:22: parameter \"float fov\": expected one number");
    expect_error("Camera \"perspective\" \"float fov\" 1.2.3", "scene.pbrt:1:34: expected a number instead of \"1.2.3\"");
    expect_error("Camera \"perspective\" \"float fov\" 1e999", "out of range");
    expect_error("Camera \"perspective\" \"float fov\" nan", "expected a number for");
    expect_error("Camera \"perspective\" \"float fov\" -nan", "expected a number");
    expect_error("Camera \"perspective\" \"float fov\" 180", "field of view");
    expect_error("Film \"rgb\" \"integer xresolution\" -4", "expected a whole number");
    expect_error("Film \"rgb\" \"integer xresolution\" 1e9", "expected a whole number");
    expect_error("WorldBegin\nAttributeBegin\n" + one_triangle, "scene.pbrt:2: AttributeBegin without AttributeEnd");
    expect_error("LookAt 0 0 0 0 0 0 0 1 0", "LookAt: eye and target coincide");
    expect_error("Transform [1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1]", "projective");
    expect_error("Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 5]", "expected ] after sixteen numbers");
    expect_error("Scale 1e200 1 1 Scale 1e200 1 1", "not finite");
    expect_error("WorldBegin Shape \"trianglemesh\" \"point3 P\" [0 0 0] \"integer indices\" [0 .5 0]", "whole numbers");
    expect_error("WorldBegin Shape \"plymesh\" \"string filename\" \"absent.ply\"", "scene.pbrt:1: ");
    expect_error("WorldBegin Shape \"plymesh\"", "name of a file is missing");
    expect_error("WorldBegin LightSource \"distant\" \"point3 to\" [0 0 0]", "different points");
    expect_error("WorldBegin LightSource \"point\" \"rgb I\" [-1 0 0]", "0 or more");
    expect_error("WorldBegin LightSource \"point\" \"rgb I\" [1e30 0 0] \"float scale\" 1e30", "too bright");
    expect_error("WorldBegin Shape \"sphere\" \"float radius\" -1", "radius");
    expect_error("", "scene.pbrt: holds no directive");
    expect_error(" \n\n", "scene.pbrt: holds no directive");
    expect_error(
        "\x7f"
        "ELF",
        "scene.pbrt:1:1: expected a directive");
}

TEST_F(ImportPbrt, HostileTextEndsInOneLine) {
    std::string deep = "WorldBegin ";
    for (int i = 0; i < 100000; ++i) deep += "AttributeBegin ";
    expect_error(deep, "deep");
    expect_error("Shape \"" + std::string(1000000, 'x'), "closing quote");
    expect_error(std::string(1000000, '['), "expected a directive");
    expect_error("Transform " + std::string(1000000, '['), "expected number 1 of 16");
    expect_error(std::string("WorldBegin \"a\0b\"", 16), "expected a directive");
    // Numbers without end are read and then found to be of no use.
    std::string many = "WorldBegin Shape \"trianglemesh\" \"point3 P\" [";
    for (int i = 0; i < 300001; ++i) many += "1 ";
    expect_error(many + "]", "a mesh without vertices or triangles is left out");
}

TEST_F(ImportPbrt, UsageErrors) {
    EXPECT_EQ(import_scene({}).status().exit_code(), 2);
    EXPECT_EQ(import_scene({"a.pbrt", "b.ply"}).status().exit_code(), 2);
    EXPECT_EQ(import_scene({"absent.pbrt"}).status().exit_code(), 1);
    EXPECT_NE(import_scene({"scene.blend"}).status().message().find("of no kind"), std::string::npos);
}

TEST(ImportPbrtSpectra, NamesAndApproximations) {
    EXPECT_TRUE(named_spectrum("metal-Ag-k"));
    EXPECT_TRUE(named_spectrum("glass-BK7"));
    EXPECT_TRUE(named_spectrum("some/folder/Au.eta.spd"));
    EXPECT_FALSE(named_spectrum("metal-Unobtainium-eta"));
    const Float3 warm = blackbody_color(2700), cool = blackbody_color(12000);
    EXPECT_GT(warm.x, warm.z);
    EXPECT_GT(cool.z, cool.x);
    EXPECT_NEAR(0.2126f * warm.x + 0.7152f * warm.y + 0.0722f * warm.z, 1, 1e-5) << "single precision";
    for (const double kelvin : {1e-6, 1.0, 1e9, 1e300})
        for (const float c : {blackbody_color(kelvin).x, blackbody_color(kelvin).y, blackbody_color(kelvin).z})
            EXPECT_TRUE(std::isfinite(c)) << kelvin;
    const Float3 ramp = sampled_color({400, 0, 700, 3});
    EXPECT_NEAR(ramp.x, 2.114, 1e-3);
    EXPECT_EQ(sampled_color({500, 2}), (Float3{2, 2, 2}));
    EXPECT_EQ(sampled_color({}), Float3());
}

}  // namespace
}  // namespace raypager
