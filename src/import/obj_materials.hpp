// The material libraries (.mtl) of OBJ files.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "import/obj_reader.hpp"
#include "import/textures.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// An image as a statement names it, and its options: u and v are multiplied, then moved.
struct ObjImage {
    std::filesystem::path path;
    std::array<double, 2> scale = {1, 1}, offset = {0, 0};
    double base = 0, gain = 1;  // values are base + gain * texel
    bool clamp = false;
    uint32_t channel = 0;  // as RP_TEXTURE_CHANNEL_SHIFT has it
};

// A material as its library has it.
struct ObjMaterial {
    std::string name;
    std::optional<Float3> diffuse, specular, emission;                              // Kd, Ks, Ke
    double shininess = 0;                                                           // Ns
    double opacity = 1, ior = 1;                                                    // d, Ni
    int illumination = -1;                                                          // illum; -1: not said
    std::optional<double> roughness, metallic;                                      // Pr, Pm
    std::optional<ObjImage> diffuse_map, specular_map, roughness_map, opacity_map;  // map_Kd, map_Ks, map_Pr, map_d
    std::optional<ObjImage> normal_map;                                             // norm, and map_Bump where that is one
    bool names_image = false;                                                       // map_Kd, found or not
};

struct ObjLibraries {
    std::vector<ObjMaterial> materials;
    std::vector<std::string> files;     // that were read
    std::vector<std::string> warnings;  // one line each
};

// What the "mtllib" lines of a model name, found beside it. A library that is not there, and a line that makes no sense, is a warning.
ObjLibraries read_obj_libraries(const std::filesystem::path& model, const std::vector<std::string>& libraries);

// What the engine has for it. Where vertices bring their colours, these take the place of Kd, with which nothing is mixed: so do viewers (MeshLab).
TexturedMaterial engine_material(const ObjMaterial& material);
// How much of it is there, where an image says so.
std::optional<Texture> cut_out_opacity(const ObjMaterial& material);
// Of what it emits, if it does.
std::optional<Float3> emitted_radiance(const ObjMaterial& material);

}  // namespace raypager
