// Rays to compare tracers with: ordinary ones, and those that find the weak places of an intersection test.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "reference/geometry.hpp"

namespace raypager::reference {

enum class RayKind {
    random,         // from anywhere in and around the bounds to a point in them
    edges,          // through a point of an edge, within rounding; some through the middle of an edge exactly, where floats can
    vertices,       // through a vertex likewise
    axis_parallel,  // one axis, both signs, zeros of both signs; through faces, edges and vertices
    in_plane,       // in the plane of a triangle, within rounding; exactly, where the geometry is parallel to an axis
    on_surface,     // starting on a primitive, within rounding, in any direction
};
inline constexpr std::array all_ray_kinds = {RayKind::random,        RayKind::edges,    RayKind::vertices,
                                             RayKind::axis_parallel, RayKind::in_plane, RayKind::on_surface};
const char* name(RayKind kind);

// Directions are of any length. tmax is infinite, or for a quarter of the rays some way into the scene.
// REQUIRES: some primitive is not degenerate.
std::vector<Ray> make_rays(const ReferenceGeometry& geometry, RayKind kind, size_t count, uint64_t seed);

}  // namespace raypager::reference
