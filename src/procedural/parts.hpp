// Machine parts: closed triangle meshes of a few basic shapes, appended to a mesh. Lengths are metres.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "procedural/numeric.hpp"

namespace raypager {

using Point2 = std::array<double, 2>;

// A right-handed orthonormal frame; parts lie along or turn about its y axis.
struct Pose {
    Vector origin = {0, 0, 0}, x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
    Vector at(double px, double py, double pz) const { return origin + x * px + y * py + z * pz; }
    Pose moved(double px, double py, double pz) const { return {at(px, py, pz), x, y, z}; }
    // With the y axis in the given direction (not null), turned about it by turns.
    static Pose along(const Vector& origin, const Vector& direction, double turns = 0);
};

// (radius, height) points turned about the y axis. Open profiles start and end on the axis and run upwards outside; closed ones never
// touch it and run upwards on their outer side. REQUIRES: segments >= 3.
void add_turned(TriangleMesh& mesh, const Pose& place, std::span<const Point2> profile, uint32_t segments, bool closed);

// The solid between two loops of equally many (x, z) points, both turning from x to z, from y = 0 to height.
void add_ring(TriangleMesh& mesh, const Pose& place, std::span<const Point2> outer, std::span<const Point2> inner, double height);

// A plate of columns x rows square cells of side cell, each with a round hole of 8 * arc corners; y = 0 to height; centred at the origin.
// hole is the radius, less than cell / 2.
void add_perforated_plate(TriangleMesh& mesh, const Pose& place, uint32_t columns, uint32_t rows, double cell, double hole, uint32_t arc,
                          double height);

// An I beam of the given half width and half height, from y = 0 to length.
void add_beam(TriangleMesh& mesh, const Pose& place, double half_width, double half_height, double length);

// A round bar along a path in world space, with flat ends. REQUIRES: at least two points, neighbours apart.
void add_bar(TriangleMesh& mesh, std::span<const Vector> path, double radius, uint32_t segments);

// Shapes made from these.
void add_cylinder(TriangleMesh& mesh, const Pose& place, double radius, double height, uint32_t segments);
void add_pipe(TriangleMesh& mesh, const Pose& place, double radius, double wall, double height, uint32_t segments);
void add_ball(TriangleMesh& mesh, const Pose& place, double radius, uint32_t segments);
void add_torus(TriangleMesh& mesh, const Pose& place, double major, double minor, uint32_t segments, uint32_t minor_segments);
// Six-sided head, shaft downwards with rings for a thread.
void add_bolt(TriangleMesh& mesh, const Pose& place, double radius, double shaft, uint32_t segments, uint32_t rings);
// Spur gear with a bore.
void add_gear(TriangleMesh& mesh, const Pose& place, double radius, uint32_t teeth, double bore, double height, uint32_t points_per_flank);
void add_spring(TriangleMesh& mesh, const Pose& place, double radius, double wire, double height, uint32_t coils, uint32_t segments);

}  // namespace raypager
