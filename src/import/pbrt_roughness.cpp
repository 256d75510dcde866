#include <algorithm>
#include <cmath>
#include <string>

#include "import/pbrt_reader.hpp"

namespace raypager {
namespace {

// GGX alpha of a roughness: pbrt-v4's square root, or the polynomial of pbrt-v3 (its TrowbridgeReitzDistribution).
double alpha_of_roughness(double roughness, bool version_3) {
    if (!version_3) return std::sqrt(std::max(roughness, 0.0));
    const double x = std::log(std::max(roughness, 1e-3));
    return 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)));
}

}  // namespace

// least: the roughness that a material is made with whose own is a texture, or where smooth ones are another kind.
void PbrtReader::PbrtRoughness::set(float least, TexturedMaterial& material) const {
    const auto set_axis = [&](const Axis& axis, uint32_t parameter, float& out) {
        out = std::max(axis.alpha, axis.texture ? std::max(least, 1e-3f) : least);
        if (axis.texture) material.textures.push_back({parameter, *axis.texture, remap});
    };
    set_axis(along, RP_PARAMETER_ALPHA, material.material.alpha);
    if (across.alpha > 0) set_axis(across, RP_PARAMETER_ALPHA_ACROSS, RP_ALPHA_ACROSS(material.material));
}

// usual: where no roughness is given.
Status PbrtReader::roughness(const PbrtParameters& parameters, const std::string& prefix, bool version_3, double usual, PbrtRoughness& result) {
    const std::string u = prefix + "uroughness", v = prefix + "vroughness", both = prefix + "roughness";
    Texture along, across;
    RAYPAGER_TRY(number_texture(parameters, {u, both}, usual, along));
    RAYPAGER_TRY(number_texture(parameters, {v, both}, usual, across));
    const bool remap = parameters.boolean("remaproughness", true);
    RAYPAGER_TRY(parameters.status());
    const bool constant = along.is_constant() && across.is_constant();
    bool same = constant ? along.mean() == across.mean() : along.node() == across.node();
    // Glass of version 3 is smooth where it says so, whatever its polynomial makes of that.
    const bool remapped = remap && !(constant && same && along.mean().x == 0 && usual == 0);
    const auto alpha_of = [&](const Texture& t) {
        const double value{t.mean().x};
        return std::min(remapped ? alpha_of_roughness(value, version_3) : value, 1.0);
    };
    const double alpha_u = alpha_of(along), alpha_v = alpha_of(across);
    constexpr double smooth = 1e-3, least = 1e-4;  // what pbrt-v4 takes for a mirror; the least in one direction of what is none
    same = same || (constant && (alpha_u == alpha_v || std::max(alpha_u, alpha_v) < smooth));
    result.along.alpha = static_cast<float>(!same ? std::max(alpha_u, least) : alpha_u < smooth ? 0 : alpha_u);
    if (!same) result.across.alpha = static_cast<float>(std::max(alpha_v, least));
    if (!along.is_constant()) result.along.texture = along;
    if (!same && !across.is_constant()) result.across.texture = across;
    result.remap = !remapped ? 0.0f : version_3 ? 2.0f : 1.0f;
    return {};
}

}  // namespace raypager
