#include "import/curves.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace raypager {
namespace {

constexpr uint32_t sides = 8;
constexpr double most_steps = 256;

struct CurvePoint {
    Vector position, tangent, normal;  // the latter of ribbons
    double width;
    double u;  // along its Bezier curve
};

Vector mix(const Vector& a, const Vector& b, double t) { return (1 - t) * a + t * b; }

// Turns a into b; they are unit vectors.
Vector turned_between(const Vector& a, const Vector& b, double t) {
    const double angle = std::acos(std::clamp(dot(a, b), -1.0, 1.0)), s = std::sin(angle);
    return s < 1e-6 ? mix(a, b, t) : 1 / s * (std::sin((1 - t) * angle) * a + std::sin(t * angle) * b);
}

// A chord of one of n steps is off by at most an eighth of the second derivative times the step squared.
uint32_t steps_of(const Vector* p, double tolerance) {
    const double bend = 6 * std::max(length(p[0] - 2 * p[1] + p[2]), length(p[1] - 2 * p[2] + p[3]));
    const double steps = std::ceil(std::sqrt(bend / (8 * tolerance)));
    return static_cast<uint32_t>(std::clamp(steps, 1.0, most_steps));
}

std::vector<CurvePoint> points_along(const CurveShape& curve) {
    const size_t count = (curve.points.size() - 1) / 3;
    const double tolerance = 0.05 * 0.5 * std::max(curve.first_width, curve.last_width);
    std::vector<CurvePoint> result;
    for (size_t k = 0; k < count; ++k) {
        const Vector* p = &curve.points[3 * k];
        uint32_t steps = steps_of(p, tolerance);
        // A ribbon also turns with its normals.
        if (curve.type == CurveShape::Type::ribbon) steps = std::max(steps, 16u);
        for (uint32_t i = k == 0 ? 0 : 1; i <= steps; ++i) {
            const double t = double(i) / steps, s = 1 - t, along = (double(k) + t) / double(count);
            CurvePoint point;
            point.u = t;
            point.position = s * s * s * p[0] + 3 * s * s * t * p[1] + 3 * s * t * t * p[2] + t * t * t * p[3];
            point.tangent = s * s * (p[1] - p[0]) + 2 * s * t * (p[2] - p[1]) + t * t * (p[3] - p[2]);
            if (!(length(point.tangent) > 0)) point.tangent = t < 0.5 ? p[2] - p[0] : p[3] - p[1];
            if (!(length(point.tangent) > 0)) point.tangent = p[3] - p[0];
            if (!curve.normals.empty()) point.normal = turned_between(curve.normals[k], curve.normals[k + 1], t);
            point.width = (1 - along) * curve.first_width + along * curve.last_width;
            if (length(point.tangent) > 0) result.push_back(point);
        }
    }
    return result;
}

Vector any_beside(const Vector& axis) { return unit(cross(axis, std::abs(axis[0]) < 0.6 ? Vector{1, 0, 0} : Vector{0, 1, 0})); }

// Gives the last row of vertices its coordinates of textures. Where one Bezier curve ends and another begins, the row is put there again.
void add_uvs_of_row(TriangleMesh& mesh, size_t columns, double u, bool last) {
    for (size_t i = 0; i < columns; ++i) mesh.uvs.push_back({static_cast<float>(u), static_cast<float>(double(i) / double(columns - 1))});
    if (u < 1 || last) return;
    const size_t first = mesh.positions.size() - columns;
    for (size_t i = 0; i < columns; ++i) {
        mesh.positions.push_back(Float3(mesh.positions[first + i]));
        mesh.normals.push_back(Float3(mesh.normals[first + i]));
        mesh.uvs.push_back({0, mesh.uvs[first + i].y});
    }
}

// Whether a row of vertices is the one before it once more.
bool is_repeated(const TriangleMesh& mesh, size_t columns, size_t row) { return !mesh.uvs.empty() && row > 0 && mesh.uvs[row * columns].x == 0; }

// Rings around the curve, each turned against the one before as little as possible.
TriangleMesh tube(const std::vector<CurvePoint>& points, bool uvs) {
    TriangleMesh mesh;
    const uint32_t columns = uvs ? sides + 1 : sides;
    // Half inside the round one and half outside.
    const double larger = 2 / (1 + std::cos(std::numbers::pi / sides));
    Vector beside = any_beside(unit(points[0].tangent));
    for (const CurvePoint& point : points) {
        const Vector axis = unit(point.tangent);
        const Vector level = beside - dot(beside, axis) * axis;
        beside = length(level) > 1e-6 ? unit(level) : any_beside(axis);
        const Vector other = cross(axis, beside);
        for (uint32_t i = 0; i < columns; ++i) {
            const double angle = 2 * std::numbers::pi * (i % sides) / sides;
            const Vector out = std::cos(angle) * beside + std::sin(angle) * other;
            mesh.positions.push_back(float3(point.position + 0.5 * larger * point.width * out));
            mesh.normals.push_back(float3(out));
        }
        if (uvs) add_uvs_of_row(mesh, columns, point.u, &point == &points.back());
    }
    const size_t rows = mesh.positions.size() / columns;
    for (uint32_t j = 0; j + 1 < rows; ++j)
        for (uint32_t i = 0; i < sides && !is_repeated(mesh, columns, j + 1); ++i) {
            const uint32_t a = j * columns + i, b = j * columns + (i + 1) % columns;
            mesh.triangles.push_back({a, b, b + columns});
            mesh.triangles.push_back({a, b + columns, a + columns});
        }
    return mesh;
}

TriangleMesh ribbon(const std::vector<CurvePoint>& points, bool uvs) {
    TriangleMesh mesh;
    for (const CurvePoint& point : points) {
        const Vector axis = unit(point.tangent), across = cross(point.normal, axis);
        const Vector beside = length(across) > 1e-9 ? unit(across) : any_beside(axis);
        const Vector normal = cross(axis, beside);
        for (const double side : {-0.5, 0.5}) {
            mesh.positions.push_back(float3(point.position + side * point.width * beside));
            mesh.normals.push_back(float3(normal));
        }
        if (uvs) add_uvs_of_row(mesh, 2, point.u, &point == &points.back());
    }
    const size_t rows = mesh.positions.size() / 2;
    for (uint32_t j = 0; j + 1 < rows; ++j) {
        if (is_repeated(mesh, 2, j + 1)) continue;
        const uint32_t a = 2 * j;
        mesh.triangles.push_back({a, a + 2, a + 3});
        mesh.triangles.push_back({a, a + 3, a + 1});
    }
    return mesh;
}

}  // namespace

size_t curve_segments(size_t points, uint32_t degree, bool spline) {
    if (points < degree + 1) return 0;
    if (spline) return points - degree;
    return (points - 1) % degree == 0 ? (points - 1) / degree : 0;
}

std::vector<Vector> cubic_bezier_points(const std::vector<Vector>& points, uint32_t degree, bool spline) {
    std::vector<Vector> result;
    const size_t count = curve_segments(points.size(), degree, spline);
    for (size_t k = 0; k < count; ++k) {
        const Vector* p = &points[spline ? k : k * degree];
        std::array<Vector, 4> q;
        if (degree == 3) {
            q = {p[0], p[1], p[2], p[3]};
            if (spline)
                q = {1.0 / 6 * (p[0] + 4 * p[1] + p[2]), mix(p[1], p[2], 1.0 / 3), mix(p[1], p[2], 2.0 / 3), 1.0 / 6 * (p[1] + 4 * p[2] + p[3])};
        } else {
            const Vector first = spline ? mix(p[0], p[1], 0.5) : p[0], last = spline ? mix(p[1], p[2], 0.5) : p[2];
            q = {first, mix(first, p[1], 2.0 / 3), mix(last, p[1], 2.0 / 3), last};
        }
        if (k == 0) result.push_back(q[0]);
        result.insert(result.end(), q.begin() + 1, q.end());
    }
    return result;
}

TriangleMesh tessellate_curve(const CurveShape& curve, bool uvs) {
    const std::vector<CurvePoint> points = points_along(curve);
    if (points.size() < 2) return {};
    return curve.type == CurveShape::Type::ribbon ? ribbon(points, uvs) : tube(points, uvs);
}

}  // namespace raypager
