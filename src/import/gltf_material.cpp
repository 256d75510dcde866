#include "import/gltf_material.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/text.hpp"

namespace raypager {
namespace {

double within(double value, double lowest, double highest, double otherwise) {
    return std::isfinite(value) ? std::clamp(value, lowest, highest) : otherwise;
}
double share(double value) { return within(value, 0, 1, 0); }

constexpr double most_radiance = 1e9;

Float3 color_of(const std::vector<double>& numbers, const Float3& otherwise, double highest = 1) {
    if (numbers.size() < 3) return otherwise;
    const auto channel = [&](size_t i) { return static_cast<float>(within(numbers[i], 0, highest, 0)); };
    return {channel(0), channel(1), channel(2)};
}

GltfTextureUse use_of(const tinygltf::TextureInfo& info) { return gltf_texture_use(info.index, std::max(info.texCoord, 0), info.extensions); }

void read_extensions(const tinygltf::ExtensionMap& extensions, GltfMaterial& m) {
    if (const auto* e = gltf_extension(extensions, "KHR_materials_ior")) m.ior = gltf_number(e, "ior", 1.5);
    if (const auto* e = gltf_extension(extensions, "KHR_materials_specular")) {
        m.specular = share(gltf_number(e, "specularFactor", 1));
        m.specular_texture = gltf_texture_use(e, "specularTexture");
        m.specular_color = color_of(gltf_numbers(e, "specularColorFactor"), {1, 1, 1}, 100);
        m.specular_color_texture = gltf_texture_use(e, "specularColorTexture");
    }
    if (const auto* e = gltf_extension(extensions, "KHR_materials_transmission")) {
        m.transmission = share(gltf_number(e, "transmissionFactor", 0));
        m.transmission_texture = gltf_texture_use(e, "transmissionTexture");
    }
    if (const auto* e = gltf_extension(extensions, "KHR_materials_volume")) {
        m.thickness = std::max(gltf_number(e, "thicknessFactor", 0), 0.0);
        m.attenuation_color = color_of(gltf_numbers(e, "attenuationColor"), {1, 1, 1});
        m.attenuation_distance = std::max(gltf_number(e, "attenuationDistance", 0), 0.0);
    }
    if (const auto* e = gltf_extension(extensions, "KHR_materials_clearcoat")) {
        m.coat = share(gltf_number(e, "clearcoatFactor", 0));
        m.coat_texture = gltf_texture_use(e, "clearcoatTexture");
        m.coat_roughness = share(gltf_number(e, "clearcoatRoughnessFactor", 0));
        m.coat_roughness_texture = gltf_texture_use(e, "clearcoatRoughnessTexture");
        m.has_coat_normals = gltf_member(e, "clearcoatNormalTexture") != nullptr;
    }
    m.unlit = extensions.contains("KHR_materials_unlit");
    if (const auto* e = gltf_extension(extensions, "KHR_materials_pbrSpecularGlossiness")) {
        const std::vector<double> diffuse = gltf_numbers(e, "diffuseFactor");
        m.base = color_of(diffuse, {1, 1, 1});
        m.opacity = diffuse.size() == 4 ? share(diffuse[3]) : 1;
        m.base_texture = gltf_texture_use(e, "diffuseTexture");
        auto& glossy = *(m.specular_glossiness = GltfMaterial::SpecularGlossiness());
        glossy.specular = color_of(gltf_numbers(e, "specularFactor"), {1, 1, 1});
        glossy.glossiness = share(gltf_number(e, "glossinessFactor", 1));
        glossy.texture = gltf_texture_use(e, "specularGlossinessTexture");
    }
}

}  // namespace

GltfMaterial read_gltf_material(const GltfModel& model, int64_t number) {
    GltfMaterial m;
    const tinygltf::Material* from = gltf_item(model.content().materials, number);
    m.place = number < 0 ? "what has no material" : fmt::format("material {}", number);
    if (!from) return m;
    if (!from->name.empty()) m.place += fmt::format(" \"{}\"", clipped(from->name));
    const auto& pbr = from->pbrMetallicRoughness;
    m.base = color_of(pbr.baseColorFactor, {1, 1, 1});
    m.opacity = pbr.baseColorFactor.size() == 4 ? share(pbr.baseColorFactor[3]) : 1;
    m.base_texture = use_of(pbr.baseColorTexture);
    m.metallic = share(pbr.metallicFactor);
    m.roughness = share(pbr.roughnessFactor);
    m.metallic_roughness_texture = use_of(pbr.metallicRoughnessTexture);
    m.normal_texture = gltf_texture_use(from->normalTexture.index, std::max(from->normalTexture.texCoord, 0), from->normalTexture.extensions);
    m.normal_scale = within(from->normalTexture.scale, -100, 100, 1);
    m.emission_texture = use_of(from->emissiveTexture);
    double strength = 1;
    if (const auto* e = gltf_extension(from->extensions, "KHR_materials_emissive_strength")) strength = gltf_number(e, "emissiveStrength", 1);
    std::vector<double> emission = from->emissiveFactor;
    for (double& channel : emission) channel *= strength;
    m.emission = color_of(emission, {0, 0, 0}, most_radiance);
    if (from->alphaMode == "MASK") m.alpha = GltfMaterial::Alpha::mask;
    if (from->alphaMode == "BLEND") m.alpha = GltfMaterial::Alpha::blend;
    m.cutoff = within(from->alphaCutoff, 0, 2, 0.5);
    m.two_sided = from->doubleSided;
    read_extensions(from->extensions, m);
    return m;
}

}  // namespace raypager
