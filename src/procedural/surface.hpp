// Smooth closed shapes as grids of quads, written in pieces, with every seam closed: vertices on it are shared within a file and have
// equal positions across files.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "procedural/scene_writer.hpp"

namespace raypager {

// rows x columns quads of two triangles. Vertex rows are 0 .. rows, vertex columns 0 .. columns; where the grid wraps, the last is the
// first. At a pole, all vertices of the first or last row are one, and the quads beside it are triangles.
struct SurfaceGrid {
    uint64_t rows = 1, columns = 1;
    bool wraps_rows = false, wraps_columns = false;
    bool first_is_pole = false, last_is_pole = false;
    // Called from several threads; must depend on its arguments alone.
    std::function<Vector(uint64_t row, uint64_t column)> position;

    uint64_t triangles() const { return columns * (2 * rows - (first_is_pole ? 1 : 0) - (last_is_pole ? 1 : 0)); }
};

// Seen from outside, rows run downwards where columns run to the right. Files: NAME-0, NAME-1, ... of at most max_triangles each.
Status write_surface(SceneWriter& scene, std::string_view name, std::string_view material, const SurfaceGrid& grid,
                     uint64_t max_triangles = max_mesh_triangles);

// The six faces of a cube of n x n quads, blown up to a sphere: radius(direction) from center.
std::vector<SurfaceGrid> displaced_sphere(uint64_t n, const Vector& center, const std::function<double(const Vector& direction)>& radius);

// A tube of rows x columns quads about a (windings, turns) torus knot in the xy plane: each turns about the core circle of major radius
// while the curve, at minor radius from it, goes windings times round the axis. thickness(row, column): the tube's radius there.
struct TorusKnot {
    Vector center = {};
    double major = 2, minor = 1;
    int windings = 2, turns = 3;
    uint64_t rows = 3, columns = 3;
    std::function<double(double along, double around)> thickness;  // both in [0, 1)
};
SurfaceGrid knot_surface(TorusKnot knot);

// A profile (radius, height) that starts and ends on the axis, as a smooth curve through the given points, turned about the vertical axis.
// relief(along, around), both in [0, 1], is added to the radius.
struct Turned {
    Vector base = {};  // where radius and height are 0
    std::vector<std::array<double, 2>> profile;
    uint64_t rows = 3, columns = 3;
    std::function<double(double along, double around)> relief;
};
SurfaceGrid turned_surface(Turned turned);

}  // namespace raypager
