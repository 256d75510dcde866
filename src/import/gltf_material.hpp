// What a material of a glTF file says, extensions included, with what holds where it says nothing.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "import/gltf_textures.hpp"

namespace raypager {

struct GltfMaterial {
    std::string place;  // for notes: "material 3 "glass""
    // Colours are linear. Textures are multiplied by the factor before them.
    Float3 base{1, 1, 1};
    double opacity = 1;
    GltfTextureUse base_texture;
    double metallic = 1, roughness = 1;
    GltfTextureUse metallic_roughness_texture;  // green: roughness, blue: metallic
    GltfTextureUse normal_texture;
    double normal_scale = 1;
    Float3 emission{0, 0, 0};
    GltfTextureUse emission_texture;
    enum class Alpha { opaque, mask, blend } alpha = Alpha::opaque;
    double cutoff = 0.5;
    bool two_sided = false, unlit = false;

    double ior = 1.5;
    double specular = 1;
    GltfTextureUse specular_texture;  // alpha
    Float3 specular_color{1, 1, 1};
    GltfTextureUse specular_color_texture;
    double transmission = 0;
    GltfTextureUse transmission_texture;  // red
    double thickness = 0;                 // more than 0: what is inside is a solid
    Float3 attenuation_color{1, 1, 1};
    double attenuation_distance = 0;  // 0: without end
    double coat = 0, coat_roughness = 0;
    GltfTextureUse coat_texture, coat_roughness_texture;  // red, green
    bool has_coat_normals = false;

    // KHR_materials_pbrSpecularGlossiness: instead of base, metallic and roughness.
    struct SpecularGlossiness {
        Float3 specular{1, 1, 1};
        double glossiness = 1;
        GltfTextureUse texture;  // alpha: glossiness
    };
    std::optional<SpecularGlossiness> specular_glossiness;
};

// number: -1 for what has none.
GltfMaterial read_gltf_material(const GltfModel& model, int64_t number);

}  // namespace raypager
