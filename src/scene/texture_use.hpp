// Which shapes have any use for coordinates of textures.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// Whether its roughness depends on the direction in which u grows.
bool is_anisotropic(const rp_material& material);
// Whether the material, or if it is a mix any of its parts, has a texture program or is anisotropic.
bool uses_uvs(const Scene& scene, uint32_t material);
// Meshes of other shapes are baked without coordinates of textures, and take no more room than if they had none.
inline bool wants_uvs(const Scene& scene, const Shape& shape) { return shape.mesh && (shape.keep_uvs || uses_uvs(scene, shape.material)); }

}  // namespace raypager
