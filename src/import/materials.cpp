#include "raypager/materials.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "import/pbrt_spectra.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

void store(const Float3& from, float* to) {
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

Float3 clamped(const Float3& c) {
    const auto share = [](float x) { return std::clamp(x, 0.0f, 1.0f); };
    return {share(c.x), share(c.y), share(c.z)};
}

rp_material layered(float ior, float alpha, uint32_t flags = 0) {
    rp_material material{};
    material.kind = RP_MATERIAL_LAYERED;
    material.flags = flags;
    material.ior = ior;
    material.alpha = alpha;
    return material;
}

// Of light that comes to a smooth interface from everywhere on its inner side, the share that is reflected. By Simpson's rule over what passes
// it from outside, which is smooth: inside, that is compressed by the square of the index.
float internal_reflectance(double ior) {
    constexpr int steps = 512;
    const auto reflected = [&](double cosine) {
        const double beyond = std::sqrt(1 - (1 - cosine * cosine) / (ior * ior));
        const double p = (ior * cosine - beyond) / (ior * cosine + beyond), s = (cosine - ior * beyond) / (cosine + ior * beyond);
        return (p * p + s * s) / 2;
    };
    double sum = 0;
    for (int i = 0; i <= steps; ++i) {
        const double cosine = static_cast<double>(i) / steps;
        sum += (i == 0 || i == steps ? 1 : i % 2 ? 4 : 2) * 2 * cosine * (ior > 1 ? reflected(cosine) : 0);
    }
    const double outer = sum / (3 * steps);
    return static_cast<float>(1 - (1 - outer) / (ior * ior));
}

}  // namespace

rp_material diffuse_material(const Float3& reflectance) {
    rp_material material{};
    material.kind = RP_MATERIAL_DIFFUSE;
    store(clamped(reflectance), material.color);
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

rp_material dielectric_material(float ior, float alpha, const Float3& reflected, const Float3& refracted) {
    constexpr Float3 white{1, 1, 1};
    if (alpha <= 0 && reflected == white && refracted == white) return dielectric_material(ior);
    rp_material material = layered(ior, alpha, RP_MATERIAL_SOLID);
    store(clamped(reflected), material.specular);
    store(clamped(refracted), material.refracted);
    return material;
}

rp_material thin_dielectric_material(float ior) {
    rp_material material = layered(ior, 0, RP_MATERIAL_THIN);
    store({1, 1, 1}, material.specular);
    store({1, 1, 1}, material.refracted);
    return material;
}

rp_material rough_diffuse_material(const Float3& reflectance, double sigma) {
    if (!(sigma > 0)) return diffuse_material(reflectance);
    rp_material material = layered(1, 0);
    store(clamped(reflectance), material.color);
    const double radians = std::min(sigma, 90.0) * (3.14159265358979323846 / 180), s2 = radians * radians;
    material.oren_a = static_cast<float>(-s2 / (2 * (s2 + 0.33)));
    material.oren_b = static_cast<float>(0.45 * s2 / (s2 + 0.09));
    return material;
}

rp_material translucent_material(const Float3& reflectance, const Float3& transmittance) {
    rp_material material = layered(1, 0);
    store(clamped(reflectance), material.color);
    store(clamped(transmittance), material.transmittance);
    return material;
}

rp_material coated_diffuse_material(const Float3& reflectance, float ior, float alpha) {
    rp_material material = layered(ior, alpha, RP_MATERIAL_COAT);
    store(clamped(reflectance), material.color);
    store({1, 1, 1}, material.specular);
    material.internal = internal_reflectance(double{ior});
    return material;
}

rp_material coated_conductor_material(const Float3& eta, const Float3& k, float base_alpha, float ior, float alpha) {
    rp_material material = layered(ior, alpha, RP_MATERIAL_COAT | RP_MATERIAL_METAL_BASE);
    store({1, 1, 1}, material.specular);
    store({eta.x / ior, eta.y / ior, eta.z / ior}, material.eta);
    store({k.x / ior, k.y / ior, k.z / ior}, material.k);
    material.base_alpha = std::max(base_alpha, 1e-3f);
    return material;
}

rp_material glossy_material(const Float3& reflectance, const Float3& normal_incidence, float alpha) {
    rp_material material = layered(1.5f, std::max(alpha, 1e-3f), RP_MATERIAL_SCHLICK);
    store(clamped(reflectance), material.color);
    store(clamped(normal_incidence), material.specular);
    return material;
}

rp_material anisotropic(rp_material material, float across, float base_across) {
    RP_ALPHA_ACROSS(material) = across;
    if (material.flags & RP_MATERIAL_METAL_BASE) RP_BASE_ALPHA_ACROSS(material) = base_across;
    return material;
}

rp_material mix_material(uint32_t first, uint32_t second, float amount) {
    rp_material material{};
    material.kind = RP_MATERIAL_MIX;
    material.first = first;
    material.second = second;
    material.amount = std::clamp(amount, 0.0f, 1.0f);
    return material;
}

rp_material with_opacity(rp_material material, float opacity) {
    const bool glossy = material.kind == RP_MATERIAL_LAYERED && material.flags == RP_MATERIAL_SCHLICK;
    if (opacity >= 1 || !(material.kind == RP_MATERIAL_DIFFUSE || glossy)) return material;
    opacity = std::max(opacity, 0.0f);
    material.kind = RP_MATERIAL_LAYERED;
    material.flags |= RP_MATERIAL_THIN | RP_MATERIAL_SMOOTH_REFRACTION;
    material.ior = 1;
    for (float* channels : {material.color, material.specular})
        for (size_t i = 0; i < 3; ++i) channels[i] *= opacity;
    store({1 - opacity, 1 - opacity, 1 - opacity}, material.refracted);
    return material;
}

rp_material clear_material() {
    rp_material material = layered(1, 0, RP_MATERIAL_THIN);
    store({1, 1, 1}, material.refracted);
    return material;
}

rp_material clay_material() { return diffuse_material({0.70f, 0.61f, 0.53f}); }

rp_material absorbing_material() {
    rp_material material{};
    material.kind = RP_MATERIAL_ABSORBING;
    return material;
}

rp_light infinite_light(const Float3& radiance) {
    rp_light light{};
    light.kind = RP_LIGHT_INFINITE;
    store(radiance, light.radiance);
    return light;
}

rp_light point_light(const Float3& position, const Float3& intensity) {
    rp_light light{};
    light.kind = RP_LIGHT_POINT;
    store(position, light.p);
    store(intensity, light.radiance);
    return light;
}

rp_light spot_light(const Float3& position, const std::array<double, 3>& axis, const Float3& intensity, double end, double full) {
    rp_light light = point_light(position, intensity);
    light.kind = RP_LIGHT_SPOT;
    store(float3(unit(axis)), light.e1);
    light.e2[0] = static_cast<float>(std::cos(end * std::numbers::pi / 180));
    light.e2[1] = static_cast<float>(std::cos(full * std::numbers::pi / 180));
    return light;
}

rp_light distant_light(const std::array<double, 3>& towards, const Float3& irradiance) {
    rp_light light{};
    light.kind = RP_LIGHT_DISTANT;
    store(float3(unit(towards)), light.p);
    store(irradiance, light.radiance);
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
