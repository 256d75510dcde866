// Curved shapes as meshes: areas and places against closed forms, normals that agree with the triangles, and surfaces that stay within their errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>

#include "import/curves.hpp"
#include "import/loop_subdivision.hpp"
#include "import/tessellate.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

Vector corner_of(const TriangleMesh& mesh, size_t triangle, size_t k) { return vector(mesh.positions[mesh.triangles[triangle][k]]); }

double area_of(const TriangleMesh& mesh) {
    double sum = 0;
    for (size_t t = 0; t < mesh.triangles.size(); t++) {
        const Vector a = corner_of(mesh, t, 0);
        sum += 0.5 * length(cross(corner_of(mesh, t, 1) - a, corner_of(mesh, t, 2) - a));
    }
    return sum;
}

double volume_of(const TriangleMesh& mesh) {
    double sum = 0;
    for (size_t t = 0; t < mesh.triangles.size(); t++) sum += dot(corner_of(mesh, t, 0), cross(corner_of(mesh, t, 1), corner_of(mesh, t, 2))) / 6;
    return sum;
}

void expect_sound(const TriangleMesh& mesh) {
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    for (const Float3& n : mesh.normals) ASSERT_NEAR(length(vector(n)), 1, 1e-5);
    for (size_t t = 0; t < mesh.triangles.size(); t++) {
        const Vector a = corner_of(mesh, t, 0), normal = cross(corner_of(mesh, t, 1) - a, corner_of(mesh, t, 2) - a);
        ASSERT_GT(length(normal), 0) << "triangle " << t;
        for (const uint32_t v : mesh.triangles[t]) ASSERT_GT(dot(normal, vector(mesh.normals[v])), 0) << "triangle " << t;
    }
}

// How far the corners of triangles, their middles and the middles of their sides are from a surface, at most.
double farthest(const TriangleMesh& mesh, const std::function<double(const Vector&)>& distance) {
    double most = 0;
    for (size_t t = 0; t < mesh.triangles.size(); t++) {
        const Vector a = corner_of(mesh, t, 0), b = corner_of(mesh, t, 1), c = corner_of(mesh, t, 2);
        for (const Vector& p : {a, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), 1.0 / 3 * (a + b + c)}) most = std::max(most, std::abs(distance(p)));
    }
    return most;
}

TEST(Tessellate, PartialSpheres) {
    const TriangleMesh zone = tessellate_partial_sphere(2, -1, 1.5, 1.25 * pi);
    expect_sound(zone);
    EXPECT_NEAR(area_of(zone), 2 * 2.5 * 1.25 * pi, 2e-4 * area_of(zone));
    EXPECT_LT(farthest(zone, [](const Vector& p) { return length(p) - 2; }), curve_error * 2);
    const TriangleMesh cap = tessellate_partial_sphere(1, 0.5, 1, 2 * pi);
    expect_sound(cap);
    EXPECT_NEAR(area_of(cap), 2 * pi * 0.5, 2e-4 * pi);
    EXPECT_EQ(*std::max_element(cap.positions.begin(), cap.positions.end(), [](const Float3& a, const Float3& b) { return a.z < b.z; }),
              (Float3{0, 0, 1}));
    const TriangleMesh half = tessellate_partial_sphere(1, -1, 1, pi);
    expect_sound(half);
    EXPECT_NEAR(area_of(half), 2 * pi, 4e-4 * pi);
    for (const Float3& p : half.positions) EXPECT_GE(p.y, -1e-6);
}

TEST(Tessellate, ConesAndParaboloids) {
    const TriangleMesh cone = tessellate_cone(2, 3, 2 * pi);
    expect_sound(cone);
    EXPECT_NEAR(area_of(cone), pi * 2 * std::sqrt(4.0 + 9), 2e-4 * area_of(cone));
    EXPECT_LT(farthest(cone, [](const Vector& p) { return std::hypot(p[0], p[1]) - 2 * (1 - p[2] / 3); }), curve_error * 2);
    const TriangleMesh bowl = tessellate_paraboloid(2, 0, 3, 2 * pi);
    expect_sound(bowl);
    EXPECT_NEAR(area_of(bowl), pi * 2 / (6 * 9.0) * (std::pow(4 + 4 * 9, 1.5) - 8), 3e-4 * area_of(bowl));
    EXPECT_LT(farthest(bowl, [](const Vector& p) { return (p[2] - 3 * (p[0] * p[0] + p[1] * p[1]) / 4) / std::hypot(1, 3); }), curve_error * 3);
    const TriangleMesh ring = tessellate_paraboloid(1, 0.25, 1, 0.5 * pi);
    expect_sound(ring);
    EXPECT_NEAR(area_of(ring), pi / 24 * (std::pow(5, 1.5) - std::pow(2, 1.5)), 3e-4);
}

TEST(Tessellate, Hyperboloids) {
    const std::array<double, 3> from = {1, -0.5, -1}, to = {0.8, 0.9, 1.2};
    const double sweep = 1.5 * pi;
    const TriangleMesh mesh = tessellate_hyperboloid(from, to, sweep);
    expect_sound(mesh);
    double expected = 0;
    constexpr int steps = 1000;
    for (int i = 0; i < steps; i++) {
        const double v = (i + 0.5) / steps;
        const Vector p = (1 - v) * from + v * to;
        expected += sweep * length(cross({-p[1], p[0], 0}, to - from)) / steps;
    }
    EXPECT_NEAR(area_of(mesh), expected, 5e-4 * expected);
    // Of a line that does not meet the axis: from its height the distance from the axis.
    EXPECT_LT(farthest(mesh,
                       [&](const Vector& p) {
                           const double v = (p[2] - from[2]) / (to[2] - from[2]);
                           const Vector on_line = (1 - v) * from + v * to;
                           return std::hypot(p[0], p[1]) - std::hypot(on_line[0], on_line[1]);
                       }),
              curve_error * 2.2);
    // A disk with a hole, and a cylinder.
    EXPECT_NEAR(area_of(tessellate_hyperboloid({1, 0, 0}, {2, 0, 0}, 2 * pi)), 3 * pi, 2e-3);
    EXPECT_NEAR(area_of(tessellate_hyperboloid({1, 0, 0}, {1, 0, 2}, 2 * pi)), 4 * pi, 2e-3);
    expect_sound(tessellate_hyperboloid({0, 0, 0}, {1, 0.5, 1}, 2 * pi));
}

TEST(Tessellate, FlatPatchesAreTwoTriangles) {
    const TriangleMesh flat = tessellate_patches({{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {}, {{0, 1, 2, 3}}});
    EXPECT_EQ(flat.triangles, (std::vector<Triangle>{{0, 1, 3}, {0, 3, 2}}));
    EXPECT_TRUE(flat.normals.empty());
}

TEST(Tessellate, TwistedPatchesMeetTheirNeighbours) {
    // z = x y over two unit squares, the second of which is given the other way round.
    const std::vector<Float3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}, {0, 2, 0}, {1, 2, 2}};
    const TriangleMesh mesh = tessellate_patches({corners, {}, {{0, 1, 2, 3}, {5, 4, 3, 2}}});
    double expected = 0;
    constexpr int steps = 200;
    for (int i = 0; i < steps; i++)
        for (int k = 0; k < 2 * steps; k++) {
            const double x = (i + 0.5) / steps, y = (k + 0.5) / steps;
            expected += std::sqrt(1 + x * x + y * y) / (steps * steps);
        }
    EXPECT_NEAR(area_of(mesh), expected, 1e-3 * expected);
    EXPECT_LT(farthest(mesh, [](const Vector& p) { return p[2] - p[0] * p[1]; }), patch_error * std::hypot(1, 2));
    std::map<float, int> on_side;  // by x, of the points with y = 1
    for (const Float3& p : mesh.positions)
        if (p.y == 1) on_side[p.x]++;
    EXPECT_GT(on_side.size(), 10u);
    for (const auto& [x, count] : on_side) EXPECT_EQ(count, 2) << x;
    expect_sound(tessellate_patches({corners, {}, {{0, 1, 2, 3}}}));
    // Given normals are interpolated.
    const std::vector<Float3> normals(6, Float3{0, 0, 2});
    for (const Float3& n : tessellate_patches({corners, normals, {{0, 1, 2, 3}}}).normals) EXPECT_EQ(n, (Float3{0, 0, 1}));
}

TEST(Tessellate, PatchesWithoutCornersAreLeftOut) {
    const TriangleMesh mesh = tessellate_patches({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}}, {}, {{0, 1, 2, 3}, {0, 1, 2, 9}}});
    EXPECT_EQ(mesh.triangles.size(), tessellate_patches({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}}, {}, {{0, 1, 2, 3}}}).triangles.size());
}

TriangleMesh octahedron() {
    TriangleMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return mesh;
}

// n x n squares, and heights that are not flat.
TriangleMesh sheet(uint32_t n, double height) {
    TriangleMesh mesh;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> number(-height, height);
    for (uint32_t j = 0; j <= n; j++)
        for (uint32_t i = 0; i <= n; i++) mesh.positions.push_back({float(i), float(j), float(number(random))});
    for (uint32_t j = 0; j < n; j++)
        for (uint32_t i = 0; i < n; i++) {
            const uint32_t a = j * (n + 1) + i;
            mesh.triangles.push_back({a, a + 1, a + n + 2});
            mesh.triangles.push_back({a, a + n + 2, a + n + 1});
        }
    return mesh;
}

// Vertices are on the limit surface after any number of levels: so those of the control mesh stay where they are.
TEST(LoopSubdivision, LimitDoesNotDependOnTheLevels) {
    for (const TriangleMesh& control : {octahedron(), sheet(4, 0.5)}) {
        const TriangleMesh first = subdivide_loop(control.positions, {}, control.triangles, 0);
        for (const uint32_t levels : {1u, 2u, 4u}) {
            const TriangleMesh mesh = subdivide_loop(control.positions, {}, control.triangles, levels);
            EXPECT_EQ(mesh.triangles.size(), control.triangles.size() << 2 * levels);
            for (size_t v = 0; v < control.positions.size(); v++)
                EXPECT_LT(length(vector(mesh.positions[v]) - vector(first.positions[v])), 1e-6) << "level " << levels << ", vertex " << v;
            expect_sound(mesh);
        }
    }
}

// By symmetry; (1 - 4 g) of the vertex and g of its four neighbours, which cancel each other but for those across.
TEST(LoopSubdivision, OctahedraBecomeRound) {
    const TriangleMesh control = octahedron(), mesh = subdivide_loop(control.positions, {}, control.triangles, 4);
    EXPECT_NEAR(mesh.positions[0].x, 0.5, 1e-6) << "1 / (4 + 3 / (8 * 3 / 32)) = 1 / 8 of each neighbour";
    for (size_t v = 0; v < 6; v++)
        for (size_t a = 0; a < 3; a++) EXPECT_NEAR(vector(mesh.normals[v])[a], vector(control.positions[v])[a], 1e-6);
    EXPECT_GT(volume_of(mesh), 0) << "still turned outwards";
    // A closed surface: its edges are shared by two triangles each, so there are two vertices more than half the triangles.
    EXPECT_EQ(mesh.positions.size(), mesh.triangles.size() / 2 + 2);
    // Inscribed triangles lose a quarter as much with each level more.
    const double volume = volume_of(subdivide_loop(control.positions, {}, control.triangles, 6));
    EXPECT_NEAR(volume_of(mesh), volume, 6e-3 * volume);
}

// A border is the cubic B-spline of its own vertices; flat ones stay flat.
TEST(LoopSubdivision, BordersAreSplines) {
    const TriangleMesh control = sheet(4, 0), mesh = subdivide_loop(control.positions, {}, control.triangles, 3);
    for (size_t v = 0; v < mesh.positions.size(); v++) {
        EXPECT_EQ(mesh.positions[v].z, 0);
        EXPECT_NEAR(mesh.normals[v].z, 1, 1e-6);
    }
    TriangleMesh bent = sheet(4, 0);
    bent.positions[2].z = 3;  // amid the lower border
    const TriangleMesh limit = subdivide_loop(bent.positions, {}, bent.triangles, 2);
    EXPECT_NEAR(limit.positions[2].z, 3 * 4.0 / 6, 1e-6);
    EXPECT_NEAR(limit.positions[1].z, 3 * 1.0 / 6, 1e-6);
    EXPECT_NEAR(limit.positions[0].z, 0, 1e-6);
}

TEST(LoopSubdivision, WhatIsNoSurfaceStaysInPlace) {
    // Two fans at a vertex, three triangles at an edge, a vertex that does not exist and one that is not finite.
    const std::vector<Float3> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}, {0, 0, 1}, {NAN, 0, 0}};
    const TriangleMesh mesh = subdivide_loop(positions, {}, {{0, 1, 2}, {0, 3, 4}, {1, 0, 5}, {0, 1, 4}, {0, 1, 9}, {1, 2, 6}, {2, 2, 1}}, 2);
    EXPECT_EQ(mesh.triangles.size(), 4u * 16);
    EXPECT_EQ(mesh.positions[0], (Float3{0, 0, 0}));
    for (const Float3& p : mesh.positions) EXPECT_TRUE(finite(p));
    EXPECT_TRUE(subdivide_loop({}, {}, {}, 3).triangles.empty());
}

// u and v in the middle of each triangle are those of pbrt, whose inverse mappings these are, but for what a step along a curved line makes of them.
void expect_uvs(const TriangleMesh& mesh, double tolerance, const std::function<std::array<double, 2>(const Vector&)>& uv) {
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
    ASSERT_FALSE(mesh.triangles.empty());
    for (size_t t = 0; t < mesh.triangles.size(); t++) {
        double u = 0, v = 0;
        for (const uint32_t corner : mesh.triangles[t]) u += mesh.uvs[corner].x / 3.0, v += mesh.uvs[corner].y / 3.0;
        const auto expected = uv(1.0 / 3 * (corner_of(mesh, t, 0) + corner_of(mesh, t, 1) + corner_of(mesh, t, 2)));
        ASSERT_NEAR(u, expected[0], tolerance) << "triangle " << t;
        ASSERT_NEAR(v, expected[1], tolerance) << "triangle " << t;
    }
}

double around_z(const Vector& p, double sweep) {
    const double angle = std::atan2(p[1], p[0]);
    return (angle < 0 ? angle + 2 * pi : angle) / sweep;
}

TEST(Tessellate, GivesTheCoordinatesOfPbrt) {
    for (const double sweep : {2 * pi, 0.75 * pi}) {
        const auto polar = [&](double v_min, double v_max) {
            return [=](const Vector& p) { return std::array{around_z(p, sweep), (std::acos(p[2] / length(p)) - v_min) / (v_max - v_min)}; };
        };
        const auto by_height = [&](double z_min, double z_max) {
            return [=](const Vector& p) { return std::array{around_z(p, sweep), (p[2] - z_min) / (z_max - z_min)}; };
        };
        expect_uvs(tessellate_partial_sphere(2, -1, 1.5, sweep, true), 0.01, polar(std::acos(-0.5), std::acos(0.75)));
        expect_uvs(tessellate_partial_sphere(1, -1, 1, sweep, true), 0.01, polar(pi, 0));
        expect_uvs(tessellate_disk(1, 2, 0.5, sweep, true), 0.01, [&](const Vector& p) {
            return std::array{around_z(p, sweep), (2 - std::hypot(p[0], p[1])) / 1.5};
        });
        expect_uvs(tessellate_disk(1, 2, 0, sweep, true), 0.01, [&](const Vector& p) {
            return std::array{around_z(p, sweep), (2 - std::hypot(p[0], p[1])) / 2};
        });
        expect_uvs(tessellate_cylinder(1, -1, 3, sweep, true), 0.01, by_height(-1, 3));
        expect_uvs(tessellate_cone(1, 3, sweep, true), 0.01, by_height(0, 3));
        expect_uvs(tessellate_paraboloid(1, 0.25, 1, sweep, true), 0.01, by_height(0.25, 1));
        // Around z from where the line is at that height.
        const Vector from = {1, 0, -1}, to = {0.5, 0.5, 2};
        expect_uvs(tessellate_hyperboloid(from, to, sweep, true), 0.01, [&](const Vector& p) {
            const double v = (p[2] + 1) / 3;
            const Vector at = (1 - v) * from + v * to;
            const double angle = std::atan2(at[0] * p[1] - at[1] * p[0], at[0] * p[0] + at[1] * p[1]);
            return std::array{(angle < 0 ? angle + 2 * pi : angle) / sweep, v};
        });
    }
    // The whole sphere, closed to the bit where it begins and ends.
    const TriangleMesh ball = tessellate_sphere(1, true);
    expect_sound(ball);
    EXPECT_NEAR(volume_of(ball), 4.0 / 3 * pi, 5e-3);
    EXPECT_TRUE(tessellate_sphere(1).uvs.empty());
    EXPECT_TRUE(tessellate_cylinder(1, 0, 1, 2 * pi).uvs.empty());
}

TEST(Tessellate, PatchesHaveGivenCoordinatesOrTheirOwn) {
    const std::vector<Float3> flat = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {2, 1, 0}}, bent = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {2, 1, 1}};
    const std::vector<Float2> given = {{0, 0}, {0.5f, 0}, {0, 4}, {0.5f, 4}};
    for (const auto& positions : {flat, bent}) {
        PatchMesh patches = {positions, {}, {{0, 1, 2, 3}}};
        EXPECT_TRUE(tessellate_patches(patches).uvs.empty());
        patches.own_uvs = true;
        expect_uvs(tessellate_patches(patches), 1e-6, [](const Vector& p) { return std::array{p[0] / 2, p[1]}; });
        patches.uvs = given;
        expect_uvs(tessellate_patches(patches), 1e-6, [](const Vector& p) { return std::array{p[0] / 4, 4 * p[1]}; });
    }
}

TEST(Loop, InterpolatesCoordinates) {
    const TriangleMesh control = sheet(4, 0);
    std::vector<Float2> uvs;
    for (const Float3& p : control.positions) uvs.push_back({2 * p.x, p.y + p.z});
    const TriangleMesh mesh = subdivide_loop(control.positions, uvs, control.triangles, 2);
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
    EXPECT_TRUE(std::equal(uvs.begin(), uvs.end(), mesh.uvs.begin()));
    const Triangle& t = mesh.triangles.back();
    EXPECT_NE(mesh.uvs[t[0]], mesh.uvs[t[1]]);
}

TEST(Curves, HaveCoordinatesAlongAndAcross) {
    for (const auto type : {CurveShape::Type::cylinder, CurveShape::Type::ribbon}) {
        CurveShape curve;
        curve.type = type;
        curve.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}, {6, 0, 0}};
        if (type == CurveShape::Type::ribbon) curve.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
        const TriangleMesh plain = tessellate_curve(curve), mesh = tessellate_curve(curve, true);
        expect_sound(mesh);
        EXPECT_TRUE(plain.uvs.empty());
        EXPECT_EQ(mesh.triangles.size(), plain.triangles.size());
        EXPECT_DOUBLE_EQ(area_of(mesh), area_of(plain));
        // Each of the two curves goes from 0 to 1.
        expect_uvs(mesh, 1, [](const Vector&) { return std::array{0.5, 0.5}; });
        for (size_t t = 0; t < mesh.triangles.size(); t++)
            for (const uint32_t v : mesh.triangles[t]) {
                const double middle = (corner_of(mesh, t, 0)[0] + corner_of(mesh, t, 1)[0] + corner_of(mesh, t, 2)[0]) / 3;
                EXPECT_NEAR(mesh.uvs[v].x, (mesh.positions[v].x - (middle < 3 ? 0 : 3)) / 3, 1e-6);
                if (type == CurveShape::Type::ribbon) {
                    EXPECT_NEAR(std::abs(mesh.uvs[v].y - 0.5), std::abs(mesh.positions[v].y), 1e-6);
                }
            }
    }
}

TEST(Curves, StraightOnesAreTubes) {
    CurveShape curve;
    curve.type = CurveShape::Type::cylinder;
    curve.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    curve.first_width = curve.last_width = 0.2;
    const TriangleMesh mesh = tessellate_curve(curve);
    expect_sound(mesh);
    EXPECT_NEAR(area_of(mesh), pi * 0.2 * 3, 0.02 * area_of(mesh)) << "eight sides";
    EXPECT_LT(farthest(mesh, [](const Vector& p) { return std::hypot(p[1], p[2]) - 0.1; }), 0.04 * 0.1);
    curve.last_width = 0;
    const TriangleMesh cone = tessellate_curve(curve);
    EXPECT_NEAR(area_of(cone), pi * 0.1 * 3, 0.02 * area_of(cone));
}

TEST(Curves, BentOnesFollowTheirLine) {
    CurveShape curve;
    constexpr double k = 0.5522847498;  // a quarter of a circle to three parts in ten thousand
    curve.points = {{1, 0, 0}, {1, k, 0}, {k, 1, 0}, {0, 1, 0}};
    curve.first_width = curve.last_width = 0.1;
    const TriangleMesh mesh = tessellate_curve(curve);
    expect_sound(mesh);
    EXPECT_NEAR(area_of(mesh), pi * 0.1 * pi / 2, 0.03 * area_of(mesh));
    EXPECT_LT(farthest(mesh, [](const Vector& p) { return std::hypot(std::hypot(p[0], p[1]) - 1, p[2]) - 0.05; }), (0.04 + 0.05) * 0.05 + 3e-4);
}

TEST(Curves, RibbonsTurnWithTheirNormals) {
    CurveShape curve;
    curve.type = CurveShape::Type::ribbon;
    curve.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    curve.first_width = curve.last_width = 0.5;
    curve.normals = {{0, 0, 1}, {0, 0, 1}};
    const TriangleMesh flat = tessellate_curve(curve);
    expect_sound(flat);
    EXPECT_NEAR(area_of(flat), 1.5, 1e-5);
    for (const Float3& n : flat.normals) EXPECT_NEAR(n.z, 1, 1e-6);
    curve.normals = {{0, 0, 1}, {0, 1, 0}};
    const TriangleMesh twisted = tessellate_curve(curve);
    EXPECT_NEAR(twisted.normals.front().z, 1, 1e-6);
    EXPECT_NEAR(twisted.normals.back().y, 1, 1e-6);
    EXPECT_GT(area_of(twisted), 1.5);
}

TEST(Curves, SplinesBecomeBezierCurves) {
    const std::vector<Vector> even = {{0, 0, 0}, {1, 2, 0}, {2, 4, 0}, {3, 6, 0}, {4, 8, 0}};
    const auto cubic = cubic_bezier_points(even, 3, true), quadratic = cubic_bezier_points(even, 2, true);
    ASSERT_EQ(cubic.size(), 7u);
    ASSERT_EQ(quadratic.size(), 10u);
    for (size_t i = 0; i < cubic.size(); i++) EXPECT_LT(length(cubic[i] - (1 + i / 3.0) * Vector{1, 2, 0}), 1e-12);
    for (size_t i = 0; i < quadratic.size(); i++) EXPECT_LT(length(quadratic[i] - (0.5 + i / 3.0) * Vector{1, 2, 0}), 1e-12);
    const auto raised = cubic_bezier_points({{0, 0, 0}, {1, 1, 0}, {2, 0, 0}}, 2, false);
    ASSERT_EQ(raised.size(), 4u);
    EXPECT_LT(length(1.0 / 8 * (raised[0] + 3 * raised[1] + 3 * raised[2] + raised[3]) - Vector{1, 0.5, 0}), 1e-12);
    EXPECT_EQ(curve_segments(7, 3, false), 2u);
    EXPECT_EQ(curve_segments(6, 3, false), 0u);
    EXPECT_EQ(curve_segments(3, 3, true), 0u);
}

}  // namespace
}  // namespace raypager
