// Textures while a scene is read.
#pragma once

#include "raypager/textures.hpp"

namespace raypager {

// Whole spheres have no coordinates of their own: their materials are given textures that are mapped around them, and the axis about which u grows,
// as pbrt does.
void map_textures_around_spheres(Scene& scene);

}  // namespace raypager
