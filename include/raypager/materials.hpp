// Materials and lights for scenes that are built in memory. Colours are linear sRGB; alpha is GGX roughness, 0 to 1.
#pragma once

#include <optional>
#include <string_view>

#include "raypager/scene.hpp"

namespace raypager {

rp_material diffuse_material(const Float3& reflectance);  // clamped to [0, 1]
rp_material conductor_material(const Float3& eta, const Float3& k, float alpha);
// The conductor that reflects this share of light that falls on it straight (eta = 1, k as in pbrt-v4).
rp_material conductor_of_reflectance(const Float3& reflectance, float alpha);
rp_material dielectric_material(float ior);
// gold, silver, copper, brass, aluminium or chrome. roughness: alpha of GGX, 0 to 1. Nothing if the name is not known.
std::optional<rp_material> named_metal(std::string_view name, float roughness);
rp_material clay_material();       // light, a little warm: what has no material of its own
rp_material absorbing_material();  // for surfaces that only emit
rp_light infinite_light(const Float3& radiance);

}  // namespace raypager
