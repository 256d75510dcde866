// The material libraries (.mtl) of OBJ files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "import/obj_reader.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// A material as its library has it.
struct ObjMaterial {
    std::string name;
    std::optional<Float3> diffuse, specular, emission;  // Kd, Ks, Ke
    double shininess = 0;                               // Ns
    double opacity = 1, ior = 1;                        // d, Ni
    int illumination = -1;                              // illum; -1: not said
    std::optional<double> roughness, metallic;          // Pr, Pm
    bool has_image = false;                             // map_Kd
};

struct ObjLibraries {
    std::vector<ObjMaterial> materials;
    std::vector<std::string> files;     // that were read
    std::vector<std::string> warnings;  // one line each
};

// What the "mtllib" lines of a model name, found beside it. A library that is not there, and a line that makes no sense, is a warning.
ObjLibraries read_obj_libraries(const std::filesystem::path& model, const std::vector<std::string>& libraries);

// What the engine has for it. Where vertices bring their colours, these take the place of Kd, with which nothing is mixed: so do viewers (MeshLab).
rp_material engine_material(const ObjMaterial& material);
// Of what it emits, if it does.
std::optional<Float3> emitted_radiance(const ObjMaterial& material);

}  // namespace raypager
