// The list of lights for next-event estimation.
#pragma once

#include <vector>

#include "raypager/scene.hpp"
#include "scene/emitters.hpp"
#include "world/world.hpp"

namespace raypager {

// Emitters with a surface (scene/emitters.hpp). Probability is left 0.
rp_light sphere_light(const WorldSphere& sphere, const AreaLight& light);
// A primitive of the world.
rp_light primitive_light(const World& world, uint32_t primitive, const AreaLight& light);

// The lights that a shape is made of which shines but is not seen.
Status add_unseen_lights(const Shape& shape, const AreaLight& light, std::vector<rp_light>& lights, MeshIssues& issues);

bool is_black(const AreaLight& light);

// Of the sphere around a scene's bounds, which set_probabilities takes; and where there are none.
double radius_of(const float (&lower)[3], const float (&upper)[3]);
inline constexpr double radius_of_nothing = 1;

// Sets each light's probability of being chosen: half by its emitted power, where infinite and distant lights emit what enters the
// bounding sphere of radius scene_radius, and half evenly over the kinds of light there are (lights.cpp); but at least 1e-6 / count, so that
// every light is found; uniform if nothing shines.
void set_probabilities(std::vector<rp_light>& lights, double scene_radius);

}  // namespace raypager
