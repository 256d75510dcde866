#include "raypager/materials.hpp"

#include <algorithm>
#include <cmath>

#include "import/pbrt_spectra.hpp"

namespace raypager {
namespace {

void store(const Float3& from, float* to) {
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

}  // namespace

rp_material diffuse_material(const Float3& reflectance) {
    const auto unit = [](float x) { return std::clamp(x, 0.0f, 1.0f); };
    rp_material material{};
    material.kind = RP_MATERIAL_DIFFUSE;
    store({unit(reflectance.x), unit(reflectance.y), unit(reflectance.z)}, material.color);
    return material;
}

rp_material conductor_material(const Float3& eta, const Float3& k, float alpha) {
    rp_material material{};
    material.kind = RP_MATERIAL_CONDUCTOR;
    material.alpha = alpha;
    store({1, 1, 1}, material.color);
    store(eta, material.eta);
    store(k, material.k);
    return material;
}

rp_material conductor_of_reflectance(const Float3& reflectance, float alpha) {
    // Just below 1, where k would be infinite.
    const auto k = [](float r) { return 2 * std::sqrt(std::clamp(r, 0.0f, 0.9999f) / (1 - std::clamp(r, 0.0f, 0.9999f))); };
    return conductor_material({1, 1, 1}, {k(reflectance.x), k(reflectance.y), k(reflectance.z)}, alpha);
}

rp_material dielectric_material(float ior) {
    rp_material material{};
    material.kind = RP_MATERIAL_DIELECTRIC;
    material.ior = ior;
    store({1, 1, 1}, material.color);
    return material;
}

rp_material clay_material() { return diffuse_material({0.70f, 0.61f, 0.53f}); }

rp_material absorbing_material() {
    rp_material material{};
    material.kind = RP_MATERIAL_NONE;
    return material;
}

rp_light infinite_light(const Float3& radiance) {
    rp_light light{};
    light.kind = RP_LIGHT_INFINITE;
    store(radiance, light.radiance);
    return light;
}

std::optional<rp_material> named_metal(std::string_view name, float roughness) {
    struct Metal {
        const char *name, *eta, *k;
    };
    constexpr Metal metals[] = {{"gold", "metal-Au-eta", "metal-Au-k"},      {"silver", "metal-Ag-eta", "metal-Ag-k"},
                                {"copper", "metal-Cu-eta", "metal-Cu-k"},    {"brass", "metal-CuZn-eta", "metal-CuZn-k"},
                                {"aluminium", "metal-Al-eta", "metal-Al-k"}, {"aluminum", "metal-Al-eta", "metal-Al-k"}};
    if (name == "chrome") return conductor_of_reflectance({0.55f, 0.556f, 0.554f}, roughness);
    for (const Metal& metal : metals)
        if (name == metal.name) return conductor_material(*named_spectrum(metal.eta), *named_spectrum(metal.k), roughness);
    return std::nullopt;
}

}  // namespace raypager
