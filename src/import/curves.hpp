// pbrt's curves as meshes.
#pragma once

#include <vector>

#include "raypager/scene.hpp"
#include "scene/vector.hpp"

namespace raypager {

struct CurveShape {
    enum class Type { flat, cylinder, ribbon };
    Type type = Type::flat;
    std::vector<Vector> points;   // of cubic Bezier curves that follow each other: 3 n + 1
    std::vector<Vector> normals;  // of a ribbon: n + 1
    double first_width = 1, last_width = 1;
};

// Control points of such curves: of Bezier curves or of a uniform B-spline, of degree 2 or 3. REQUIRES: their number is right.
std::vector<Vector> cubic_bezier_points(const std::vector<Vector>& points, uint32_t degree, bool spline);
// Of how many curves; 0: the number is not right.
size_t curve_segments(size_t points, uint32_t degree, bool spline);

// Ribbons are strips, all others tubes of eight sides, open at both ends, with normals as round ones have. Tubes are nowhere farther from round ones
// than 4 % of their radius, and lines along the curve nowhere farther from it than 5 % of half its greatest width, unless that took more than 256
// steps for one of the Bezier curves. uvs: with coordinates of textures: u goes from 0 to 1 along each of the Bezier curves, v across a ribbon or
// once around a tube.
TriangleMesh tessellate_curve(const CurveShape& curve, bool uvs = false);

}  // namespace raypager
