#include "scene/check_material.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace raypager {
namespace {

bool within(std::span<const float> values, float lowest, float highest) {
    return std::all_of(values.begin(), values.end(), [&](float x) { return std::isfinite(x) && x >= lowest && x <= highest; });
}

// That across the tangent, beside the one along it.
const char* fault_of_across(float along, float across) {
    if (!(across >= 0 && across <= 1)) return "roughness across the tangent must be 0 to 1";
    return across > 0 && !(along > 0) ? "what is rough across the tangent must be rough along it" : nullptr;
}

bool shares(const float (&values)[3]) { return within(values, 0, 1); }

const char* fault_of_metal(const rp_material& m, float alpha, float across) {
    constexpr float largest = 1e18f;  // whose square is finite
    if (!within(m.eta, 0, largest) || !within(m.k, 0, largest)) return "eta and k must be 0 or more";
    for (size_t i = 0; i < 3; ++i)
        if (m.eta[i] == 0 && m.k[i] == 0) return "eta and k must not both be 0";
    return alpha >= 0 && alpha <= 1 ? fault_of_across(alpha, across) : "roughness must be 0 to 1";
}

const char* fault_of_layers(const rp_material& m) {
    if (!(m.ior > 0.01f && m.ior < 100)) return "the index of refraction must be between 0.01 and 100";
    if (!(m.alpha >= 0 && m.alpha <= 1)) return "roughness must be 0 to 1";
    if (const char* fault = fault_of_across(m.alpha, RP_ALPHA_ACROSS(m))) return fault;
    if (!shares(m.color) || !shares(m.specular) || !shares(m.refracted) || !shares(m.transmittance) || !shares(m.mirror))
        return "what it reflects and transmits must be 0 to 1";
    const uint32_t base = m.flags & (RP_MATERIAL_COAT | RP_MATERIAL_BLEND | RP_MATERIAL_SCHLICK);
    if (base & (base - 1)) return "its base is lit in more than one way";
    if (base & (RP_MATERIAL_BLEND | RP_MATERIAL_SCHLICK) && !(m.alpha > 0)) return "an interface of this kind must be rough";
    if (m.flags & RP_MATERIAL_THIN && m.alpha > 0 && !(m.flags & RP_MATERIAL_SMOOTH_REFRACTION)) return "what a thin sheet refracts passes smoothly";
    if (!(m.oren_a >= -0.5f && m.oren_a <= 0) || !(m.oren_b >= 0 && m.oren_b <= 0.45f)) return "the roughness of its base is out of range";
    if (!(m.flags & RP_MATERIAL_METAL_BASE))
        return m.internal >= 0 && m.internal < 1 ? nullptr : "the inner reflectance of its coat must be 0 or more, and less than 1";
    if (!(m.flags & RP_MATERIAL_COAT) || !(m.ior >= 1)) return "metal lies under a coat, whose index is at least 1";
    return m.base_alpha > 0 ? fault_of_metal(m, m.base_alpha, RP_BASE_ALPHA_ACROSS(m)) : "metal under a coat must be rough";
}

const char* fault_of(std::span<const rp_material> materials, size_t index) {
    const rp_material& m = materials[index];
    switch (m.kind) {
        case RP_MATERIAL_DIFFUSE:
            return shares(m.color) ? nullptr : "reflectance must be 0 to 1";
        case RP_MATERIAL_CONDUCTOR:
            return fault_of_metal(m, m.alpha, RP_ALPHA_ACROSS(m));
        case RP_MATERIAL_DIELECTRIC:
            return m.ior > 0 && std::isfinite(m.ior) ? nullptr : "the index of refraction must be more than 0";
        case RP_MATERIAL_ABSORBING:
            return nullptr;
        case RP_MATERIAL_LAYERED:
            return fault_of_layers(m);
        case RP_MATERIAL_MIX:
            if (!(m.amount >= 0 && m.amount <= 1)) return "the share of the second material must be 0 to 1";
            if ((m.first >= index && m.first != RP_NONE) || m.second >= index) return "it mixes materials that do not come before it";
            return mix_depth(materials, index) <= RP_MAX_MIXES ? nullptr : "there are too many mixes within each other";
        default:
            return "of an unknown kind";
    }
}

}  // namespace

uint32_t mix_depth(std::span<const rp_material> materials, size_t index) {
    // Each is checked after those that it is made of, so more levels than these have been refused.
    uint32_t depth = 0;
    std::vector<size_t> level = {index}, next;
    for (; depth <= RP_MAX_MIXES; ++depth, level.swap(next)) {
        next.clear();
        for (const size_t i : level)
            if (i != RP_NONE && materials[i].kind == RP_MATERIAL_MIX) next.insert(next.end(), {materials[i].first, materials[i].second});
        if (next.empty()) return depth;
    }
    return depth;
}

bool may_be_nothing(std::span<const rp_material> materials, size_t index) {
    const rp_material& m = materials[index];
    if (m.kind != RP_MATERIAL_MIX) return false;
    return m.first == RP_NONE || may_be_nothing(materials, m.first) || may_be_nothing(materials, m.second);
}

Status check_material(std::span<const rp_material> materials, size_t index) {
    const char* fault = fault_of(materials, index);
    return fault ? Status::failed(fmt::format("material {}: {}", index, fault)) : Status();
}

}  // namespace raypager
