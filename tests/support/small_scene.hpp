// A scene with a little of everything, for tests of the engine as a whole.
#pragma once

#include "raypager/scene.hpp"

namespace raypager::support {

// About 2 n^2 triangles: a wavy plane with shading normals, four spheres, every material, a triangle that shines, every kind of light.
// 12 x 8 pixels. colors: the plane has some at its vertices, and coordinates of textures.
Scene small_scene(uint32_t n, bool colors = false);

}  // namespace raypager::support
