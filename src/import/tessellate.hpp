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
// uvs: with coordinates of textures, as pbrt defines them: u around z, v along what is turned about it (of a disk from its rim inwards).
TriangleMesh tessellate_sphere(double radius, bool uvs = false);
TriangleMesh tessellate_partial_sphere(double radius, double z_min, double z_max, double sweep, bool uvs = false);
TriangleMesh tessellate_disk(double height, double radius, double inner_radius, double sweep, bool uvs = false);
TriangleMesh tessellate_cylinder(double radius, double z_min, double z_max, double sweep, bool uvs = false);
TriangleMesh tessellate_cone(double radius, double height, double sweep, bool uvs = false);
TriangleMesh tessellate_paraboloid(double radius, double z_min, double z_max, double sweep, bool uvs = false);
TriangleMesh tessellate_hyperboloid(const std::array<double, 3>& from, const std::array<double, 3>& to, double sweep, bool uvs = false);

// Patches of four corners p00, p10, p01, p11, as indices into positions, and normals for all of these or none. Flat ones become two triangles each.
// If any is not, all of them are cut alike, so that neighbours meet: no point of a patch is farther from its triangles than patch_error of its
// longest side, unless there would be more than max_patch_triangles triangles.
// Coordinates of textures may be given as normals are. If they are not: with own_uvs they are those of a patch itself, (0, 0), (1, 0), (0, 1) and (1,
// 1) at its corners.
inline constexpr double patch_error = 1e-3;
inline constexpr uint64_t max_patch_triangles = uint64_t{1} << 24;
using Patch = std::array<uint32_t, 4>;
struct PatchMesh {
    std::vector<Float3> positions, normals;
    std::vector<Patch> patches;
    std::vector<Float2> uvs = {};
    bool own_uvs = false;
};
TriangleMesh tessellate_patches(const PatchMesh& mesh);

}  // namespace raypager
