#include "world/placement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/octahedral.hpp"

namespace raypager {
namespace {

Float3 rounded(const std::array<double, 3>& p) { return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}; }

}  // namespace

Status out_of_range(const Shape& shape, uint64_t vertex, const Float3& p) {
    return Status::failed(
        fmt::format("{}: vertex {} lies at ({}, {}, {}) in the world; coordinates up to {} are supported: scale the scene, or remove it", shape.name,
                    vertex, p.x, p.y, p.z, largest_coordinate));
}

// Differences of floats are exact in double precision unless their magnitudes are far apart.
bool has_no_area(const Float3& a, const Float3& b, const Float3& c) {
    const double ux = double(b.x) - a.x, uy = double(b.y) - a.y, uz = double(b.z) - a.z;
    const double vx = double(c.x) - a.x, vy = double(c.y) - a.y, vz = double(c.z) - a.z;
    return uy * vz == uz * vy && uz * vx == ux * vz && ux * vy == uy * vx;
}

PlacedShape::PlacedShape(const Shape& shape, float position_cell)
    : to_world_(shape.to_world),
      cell_(position_cell),
      identity_(shape.to_world.is_identity()),
      flips_(shape.reverse_orientation != shape.to_world.swaps_handedness()) {
    if (const auto inverse = shape.to_world.inverse()) normals_ = inverse->transpose();
}

Float3 PlacedShape::point(const Float3& p) const {
    if (cell_ == 0) return identity_ ? p : rounded(to_world_.point(p.x, p.y, p.z));
    std::array<double, 3> placed = {p.x, p.y, p.z};
    if (!identity_) placed = to_world_.point(p.x, p.y, p.z);
    // Without -0, of which no multiple comes back where positions are coded. Where floats are coarser than cells, rounding keeps them multiples.
    for (double& coordinate : placed) coordinate = std::nearbyint(coordinate / cell_) * cell_ + 0.0;
    return rounded(placed);
}

uint32_t PlacedShape::normal(const Float3& n) const {
    if (!normals_) return RP_NONE;
    const auto placed = normals_->vector(n.x, n.y, n.z);
    return encode_octahedral(placed[0], placed[1], placed[2]);
}

Result<std::optional<WorldSphere>> place_sphere(const Shape& shape) {
    const SpherePrimitive& s = shape.sphere;
    const auto center = shape.to_world.point(s.center.x, s.center.y, s.center.z);
    const auto x = shape.to_world.vector(1, 0, 0), y = shape.to_world.vector(0, 1, 0), z = shape.to_world.vector(0, 0, 1);
    const double lengths[3] = {std::hypot(x[0], x[1], x[2]), std::hypot(y[0], y[1], y[2]), std::hypot(z[0], z[1], z[2])};
    const double longest = std::max({lengths[0], lengths[1], lengths[2]}), shortest = std::min({lengths[0], lengths[1], lengths[2]});
    if (longest - shortest > 1e-3 * longest)
        return Status::failed(fmt::format("{}: a sphere scaled unevenly is an ellipsoid, which is not supported; use a mesh", shape.name));
    const WorldSphere sphere = {rounded(center), static_cast<float>(s.radius * (lengths[0] + lengths[1] + lengths[2]) / 3)};
    if (!in_range(sphere.center) || !(std::abs(sphere.radius) <= largest_coordinate))
        return Status::failed(fmt::format("{}: the sphere reaches beyond {}, the largest supported coordinate; scale the scene, or remove it",
                                          shape.name, largest_coordinate));
    if (!(sphere.radius > 0)) return std::optional<WorldSphere>();
    return std::optional(sphere);
}

}  // namespace raypager
