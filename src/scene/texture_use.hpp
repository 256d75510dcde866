// Which shapes have any use for coordinates of textures.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// Whether the material, or if it is a mix any of its parts, has a texture program.
bool has_texture_program(const Scene& scene, uint32_t material);
// Meshes of other shapes are baked without coordinates of textures, and take no more room than if they had none.
inline bool wants_uvs(const Scene& scene, const Shape& shape) { return shape.mesh && has_texture_program(scene, shape.material); }

}  // namespace raypager
