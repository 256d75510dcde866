// Materials and lights as the engine has them.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

rp_material diffuse_material(const Float3& reflectance);  // clamped to [0, 1]
rp_material conductor_material(const Float3& eta, const Float3& k, float alpha);
// The conductor that reflects this share of light that falls on it straight (eta = 1, k as in pbrt-v4).
rp_material conductor_of_reflectance(const Float3& reflectance, float alpha);
rp_material dielectric_material(float ior);
rp_material clay_material();       // light, a little warm: what has no material of its own
rp_material absorbing_material();  // for surfaces that only emit
rp_light infinite_light(const Float3& radiance);

}  // namespace raypager
