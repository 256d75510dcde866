// Materials and lights for scenes that are built in memory. Colours are linear sRGB; alpha is GGX roughness, 0 to 1.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

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
// Light without a surface; intensity is what it gives a facing surface at distance 1.
rp_light point_light(const Float3& position, const Float3& intensity);
// It shines along axis within `full` degrees of it, and ends at `end` degrees. REQUIRES of directions: some length; 0 <= full <= end <= 180.
rp_light spot_light(const Float3& position, const std::array<double, 3>& axis, const Float3& intensity, double end, double full);
// towards: where it comes from; irradiance: on a surface that faces it.
rp_light distant_light(const std::array<double, 3>& towards, const Float3& irradiance);

// A parameter of a material that an image says: its texel at (u, v) times scale. v goes upwards, rows of images come from the top; outside of
// 0 to 1 it repeats.
struct ImageParameter {
    uint32_t parameter = RP_PARAMETER_COLOR;  // RP_PARAMETER_* (abi/texture.h)
    std::shared_ptr<const ImageSource> image;
    Float3 scale{1, 1, 1};
    std::array<float, 2> repeat{1, 1};  // times from 0 to 1, along u and v
};
// Adds a material, some of whose parameters are images, and returns its number. A usage error if they are more than a path can keep texels of.
Result<uint32_t> add_material(Scene& scene, const rp_material& material, std::span<const ImageParameter> images);
// To be called when all shapes are there, also those of objects: spheres get coordinates of textures around them.
void prepare_spheres(Scene& scene);

}  // namespace raypager
