// pbrt scenes, with a mesh and a file to include beside them; the scene can also include itself.
#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "raypager/import.hpp"
#include "unit/import_files.hpp"

namespace raypager::fuzz {
namespace {

// Every directive that the importer knows, most of their parameters, and some that it does not know.
const char* const all_directives = R"(# a comment
Option "disablepixeljitter" true
Film "rgb" "integer xresolution" [64] "integer yresolution" 48 "string filename" "a.exr" "float iso" 200 "float whitebalance" 5000
 "float cropwindow" [0 .5 .25 1]
Sampler "stratified" "integer xsamples" 2 "integer ysamples" 2
PixelFilter "gaussian" "float xradius" 2 "float sigma" 0.7
Integrator "volpath" "integer maxdepth" 7
Scale -1 1 1
LookAt 0 1 -5  0 0 0  0 1 0
CoordinateSystem "here"
Camera "perspective" "float fov" 45.5 "float lensradius" 0.1 "float focaldistance" 5 "float screenwindow" [-1 1 -1 .5] "float frameaspectratio" 1.5
WorldBegin
LightSource "infinite" "rgb L" [.3 .3 .3] "float scale" 2
LightSource "distant" "point3 from" [0 10 0] "point3 to" [0 0 0] "blackbody L" 5500
LightSource "spot" "rgb I" [1 2 3] "point3 from" [1 1 1]
Texture "t" "spectrum" "checkerboard" "rgb tex1" [1 0 0] "rgb tex2" [0 1 0]
Texture "f" "float" "mix" "float tex1" -1 "float amount" .5
Texture "s" "spectrum" "scale" "texture tex" "t" "float scale" .5
MakeNamedMaterial "gold" "string type" "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.1
AttributeBegin
  Translate 1 0 0 Rotate 30 0 1 0 ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]
  NamedMaterial "gold"
  AreaLightSource "diffuse" "rgb L" [5 5 5] "bool twosided" true
  Shape "sphere" "float radius" 0.5
AttributeEnd
Material "coateddiffuse" "texture reflectance" "s" "float roughness" [0]
Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2] "normal N" [0 0 1 0 0 1 0 0 1]
Material "dielectric" "float eta" 1.5
Shape "plymesh" "string filename" "mesh.ply"
Material "diffuse" "spectrum reflectance" [400 .1 500 .4 700 .8]
ObjectBegin "o" Shape "disk" "float radius" 2 Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 0] ObjectEnd
TransformBegin Scale 2 2 2 ObjectInstance "o" TransformEnd
ReverseOrientation
Shape "cylinder" "float zmin" -1 "float zmax" 1 "float phimax" 180
Shape "sphere" "float zmin" -.5 "float phimax" 200 Shape "cone" "float height" 2 Shape "paraboloid" "float zmax" 2
Shape "hyperboloid" "point3 p1" [1 0 0]
Shape "loopsubdiv" "integer levels" 2 "point3 P" [0 0 0 1 0 0 0 1 0 0 0 1] "integer indices" [0 2 1 0 1 3 1 2 3 0 3 2]
Shape "curve" "string type" "ribbon" "point3 P" [0 0 0 1 0 0 2 1 0 3 0 0] "normal3 N" [0 0 1 0 1 0] "float width0" 0.1
Shape "curve" "string basis" "bspline" "integer degree" 2 "point3 P" [0 0 0 1 0 0 2 1 0 3 0 0] "string type" "cylinder"
Include "other.pbrt"
Import "other.pbrt"
ActiveTransform All
)";

constexpr uint64_t largest_tessellation = 2400000;  // bytes; an ellipsoid's, with 65024 triangles and normals
// Of control meshes, patches and curves: each byte of a file that says a new one may become so many.
constexpr uint64_t tessellation_per_byte = 1 << 15;

}  // namespace

std::vector<std::string> seeds() {
    return {all_directives,
            "Film \"image\" \"integer pixelbounds\" [0 9 0 9] PixelFilter \"mitchell\" Camera \"environment\" WorldBegin Shape \"sphere\"",
            "Camera \"orthographic\" \"float lensradius\" 1 WorldBegin Shape \"sphere\"", "WorldBegin Include \"input.pbrt\"",
            "Identity Transform [1 0 0 0 0 2 0 0 0 0 1 0 0 0 0 1] Shape \"sphere\" WorldEnd"};
}

void run(std::string_view input) {
    write_input("mesh.ply", test::to_ply_binary(test::make_box()));
    write_input("other.pbrt", "Material \"matte\" \"color Kd\" [.1 .2 .3]\nShape \"cylinder\"\n");
    const auto scene = import_scene({write_input("input.pbrt", input)});
    if (!scene) return;
    // Curved shapes become meshes of fixed sizes, or in proportion to what is said of them; those must not add up with instances. To make each would
    // take most of the time here.
    uint64_t bytes = 0, meshes = 0;
    std::shared_ptr<const MeshSource> last;
    for (const Shape& shape : scene->shapes) {
        bytes += sizeof shape;
        if (!shape.mesh || shape.mesh == last || !shape.mesh->files().empty()) continue;
        last = shape.mesh;
        bytes += largest_tessellation;
        TriangleMesh mesh;
        MeshIssues issues;
        if (meshes++ < 2 && shape.mesh->load(mesh, issues) && mesh.triangles.size() > input.size())
            RAYPAGER_CHECK(mesh.positions.size() * 2 * sizeof(Float3) + mesh.triangles.size() * sizeof(Triangle) <=
                           largest_tessellation + input.size() * tessellation_per_byte);
    }
    check_proportion(bytes, input, uint64_t{1} << 18);
}

}  // namespace raypager::fuzz
