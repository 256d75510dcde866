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
// A rough, or coloured, dielectric: what it reflects and refracts by the Fresnel equations is multiplied by these, each 0 to 1.
rp_material dielectric_material(float ior, float alpha, const Float3& reflected, const Float3& refracted);
rp_material thin_dielectric_material(float ior);  // a sheet of it: what passes goes straight on
// Diffuse, with microfacets of standard deviation sigma (degrees; Oren and Nayar 1994).
rp_material rough_diffuse_material(const Float3& reflectance, double sigma);
// Diffuse reflection on the one side and transmission on the other, the same from both.
rp_material translucent_material(const Float3& reflectance, const Float3& transmittance);
// A coat of index ior (1 or more) and roughness alpha over a diffuse base, or over a conductor of roughness base_alpha (more than 0).
rp_material coated_diffuse_material(const Float3& reflectance, float ior, float alpha);
rp_material coated_conductor_material(const Float3& eta, const Float3& k, float base_alpha, float ior, float alpha);
// Diffuse and glossy, as glTF 2.0 has it: normal_incidence is what the glossy part reflects of light that falls on it straight.
rp_material glossy_material(const Float3& reflectance, const Float3& normal_incidence, float alpha);
// The same, where alpha is the roughness along the direction in which u grows: across is that across it, base_across that of a metallic base. 0: the
// same as along it.
rp_material anisotropic(rp_material material, float across, float base_across = 0);
// One of two materials of the scene, by their numbers: `second` as often as amount (0 to 1) says. It has to come behind both.
rp_material mix_material(uint32_t first, uint32_t second, float amount);
// What reflects, less the share 1 - opacity that passes straight through. For diffuse and glossy materials; others stay as they are.
rp_material with_opacity(rp_material material, float opacity);
rp_material clear_material();  // lets everything through: what has an opacity is a mix with it
// gold, silver, copper, brass, aluminium or chrome. roughness: alpha of GGX, 0 to 1. Nothing if the name is not known.
std::optional<rp_material> named_metal(std::string_view name, float roughness);
rp_material clay_material();       // light, a little warm: what has no material of its own
rp_material absorbing_material();  // for surfaces that only emit
rp_light infinite_light(const Float3& radiance);

}  // namespace raypager
