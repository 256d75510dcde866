// Curved shapes as meshes, for those that the engine does not trace exactly.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

// All in object space as pbrt defines them, with normals, oriented outwards (disk: towards +z; hyperboloid: as its line is given). sweep: radians
// about z, up to 2 pi. No point of a surface is farther from its triangles than curve_error of the shape's size: of its radius and, where lines along
// it are curved or twisted as well, of its height.
inline constexpr double curve_error = 2e-4;
TriangleMesh tessellate_sphere(double radius);
TriangleMesh tessellate_partial_sphere(double radius, double z_min, double z_max, double sweep);
TriangleMesh tessellate_disk(double height, double radius, double inner_radius, double sweep);
TriangleMesh tessellate_cylinder(double radius, double z_min, double z_max, double sweep);
TriangleMesh tessellate_cone(double radius, double height, double sweep);
TriangleMesh tessellate_paraboloid(double radius, double z_min, double z_max, double sweep);
TriangleMesh tessellate_hyperboloid(const std::array<double, 3>& from, const std::array<double, 3>& to, double sweep);

// Patches of four corners p00, p10, p01, p11, as indices into positions, and normals for all of these or none. Flat ones become two triangles each.
// If any is not, all of them are cut alike, so that neighbours meet: no point of a patch is farther from its triangles than patch_error of its
// longest side, unless there would be more than max_patch_triangles triangles.
inline constexpr double patch_error = 1e-3;
inline constexpr uint64_t max_patch_triangles = uint64_t{1} << 24;
using Patch = std::array<uint32_t, 4>;
TriangleMesh tessellate_patches(const std::vector<Float3>& positions, const std::vector<Float3>& normals, const std::vector<Patch>& patches);

}  // namespace raypager
