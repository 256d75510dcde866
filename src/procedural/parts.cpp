#include "procedural/parts.hpp"

#include <cmath>

#include "base/check.hpp"

namespace raypager {
namespace {

uint32_t add_vertex(TriangleMesh& mesh, const Vector& position) {
    mesh.positions.push_back(float3(position));
    return static_cast<uint32_t>(mesh.positions.size() - 1);
}

// A quad with corners in counter-clockwise order seen from outside.
void add_quad(TriangleMesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
}

// Vertices of a loop of (x, z) points at height y.
std::vector<uint32_t> add_loop(TriangleMesh& mesh, const Pose& place, std::span<const Point2> points, double y) {
    std::vector<uint32_t> loop;
    for (const Point2& p : points) loop.push_back(add_vertex(mesh, place.at(p[0], y, p[1])));
    return loop;
}

// The wall below a loop that turns from x to z, seen from outside the loop; the other way round, from inside.
void add_wall(TriangleMesh& mesh, std::span<const uint32_t> top, std::span<const uint32_t> bottom, bool from_outside) {
    const size_t n = top.size();
    for (size_t i = 0; i < n; i++) {
        const size_t j = (i + 1) % n;
        if (from_outside)
            add_quad(mesh, top[i], top[j], bottom[j], bottom[i]);
        else
            add_quad(mesh, top[j], top[i], bottom[i], bottom[j]);
    }
}

// A triangle of an upper face, and its mirror image in the lower face.
struct Faces {
    TriangleMesh& mesh;
    void add(uint32_t top_a, uint32_t top_b, uint32_t top_c, uint32_t bottom_a, uint32_t bottom_b, uint32_t bottom_c) const {
        mesh.triangles.push_back({top_a, top_b, top_c});
        mesh.triangles.push_back({bottom_a, bottom_c, bottom_b});
    }
};

std::vector<Point2> circle(double radius, uint32_t points) {
    std::vector<Point2> result;
    for (uint32_t i = 0; i < points; i++) {
        const SinCos angle = sincos_turns(static_cast<double>(i) / points);
        result.push_back({radius * angle.cos, radius * angle.sin});
    }
    return result;
}

Vector any_perpendicular(const Vector& direction) {
    return unit(std::abs(direction[1]) < 0.9 * length(direction) ? cross(direction, {0, 1, 0}) : cross(direction, {1, 0, 0}));
}

}  // namespace

Pose Pose::along(const Vector& origin, const Vector& direction, double turns) {
    const Vector y = unit(direction), side = any_perpendicular(y), other = cross(side, y);
    const SinCos angle = sincos_turns(turns);
    const Vector x = side * angle.cos + other * angle.sin;
    return {origin, x, y, cross(x, y)};
}

void add_turned(TriangleMesh& mesh, const Pose& place, std::span<const Point2> profile, uint32_t segments, bool closed) {
    RAYPAGER_CHECK(segments >= 3 && profile.size() >= 3);
    const std::vector<Point2> round = circle(1, segments);
    const size_t n = profile.size();
    std::vector<std::vector<uint32_t>> rings;
    for (size_t i = 0; i < n; i++) {
        const auto [radius, y] = profile[i];
        std::vector<uint32_t>& ring = rings.emplace_back();
        if (!closed && (i == 0 || i == n - 1)) {
            ring.assign(segments, add_vertex(mesh, place.at(0, y, 0)));
            continue;
        }
        for (const Point2& u : round) ring.push_back(add_vertex(mesh, place.at(radius * u[0], y, radius * u[1])));
    }
    for (size_t i = 0; i + (closed ? 0 : 1) < n; i++) {
        const std::vector<uint32_t>&lower = rings[i], &upper = rings[(i + 1) % n];
        for (uint32_t j = 0; j < segments; j++) {
            const uint32_t k = (j + 1) % segments;
            if (lower[j] != lower[k]) mesh.triangles.push_back({lower[j], upper[j], lower[k]});
            if (upper[j] != upper[k]) mesh.triangles.push_back({lower[k], upper[j], upper[k]});
        }
    }
}

void add_ring(TriangleMesh& mesh, const Pose& place, std::span<const Point2> outer, std::span<const Point2> inner, double height) {
    RAYPAGER_CHECK(outer.size() == inner.size() && outer.size() >= 3);
    const std::vector<uint32_t> outer_top = add_loop(mesh, place, outer, height), outer_bottom = add_loop(mesh, place, outer, 0);
    const std::vector<uint32_t> inner_top = add_loop(mesh, place, inner, height), inner_bottom = add_loop(mesh, place, inner, 0);
    const Faces faces{mesh};
    for (size_t i = 0; i < outer.size(); i++) {
        const size_t j = (i + 1) % outer.size();
        faces.add(outer_top[i], inner_top[i], inner_top[j], outer_bottom[i], inner_bottom[i], inner_bottom[j]);
        faces.add(outer_top[i], inner_top[j], outer_top[j], outer_bottom[i], inner_bottom[j], outer_bottom[j]);
    }
    add_wall(mesh, outer_top, outer_bottom, true);
    add_wall(mesh, inner_top, inner_bottom, false);
}

void add_perforated_plate(TriangleMesh& mesh, const Pose& place, uint32_t columns, uint32_t rows, double cell, double hole, uint32_t arc,
                          double height) {
    RAYPAGER_CHECK(columns > 0 && rows > 0 && arc > 0 && hole < cell / 2);
    // Corners and edge middles of the cells lie on a lattice of half cells; cell centres stay unused, so number on demand.
    const uint32_t across = 2 * columns + 1;
    std::vector<uint32_t> top(size_t{across} * (2 * rows + 1), RP_NONE), bottom(top);
    const auto lattice = [&](uint32_t u, uint32_t v) {
        const size_t at = size_t{v} * across + u;
        if (top[at] == RP_NONE) {
            const double x = (0.5 * u - 0.5 * columns) * cell, z = (0.5 * v - 0.5 * rows) * cell;
            top[at] = add_vertex(mesh, place.at(x, height, z));
            bottom[at] = add_vertex(mesh, place.at(x, 0, z));
        }
        return at;
    };
    // Around a cell's centre, turning from x to z.
    constexpr int around[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
    const std::vector<Point2> rim = circle(hole, 8 * arc);
    const Faces faces{mesh};
    for (uint32_t row = 0; row < rows; row++)
        for (uint32_t column = 0; column < columns; column++) {
            const uint32_t u = 2 * column + 1, v = 2 * row + 1;
            const Pose centre = place.moved((0.5 * u - 0.5 * columns) * cell, 0, (0.5 * v - 0.5 * rows) * cell);
            const std::vector<uint32_t> rim_top = add_loop(mesh, centre, rim, height), rim_bottom = add_loop(mesh, centre, rim, 0);
            add_wall(mesh, rim_top, rim_bottom, false);
            for (uint32_t k = 0; k < 8; k++) {
                const size_t p = lattice(u + static_cast<uint32_t>(around[k][0]), v + static_cast<uint32_t>(around[k][1]));
                const size_t q = lattice(u + static_cast<uint32_t>(around[(k + 1) % 8][0]), v + static_cast<uint32_t>(around[(k + 1) % 8][1]));
                for (uint32_t i = k * arc; i < (k + 1) * arc; i++) {
                    const uint32_t j = (i + 1) % (8 * arc);
                    faces.add(top[p], rim_top[i], rim_top[j], bottom[p], rim_bottom[i], rim_bottom[j]);
                }
                const uint32_t last = (k + 1) * arc % (8 * arc);
                faces.add(top[p], rim_top[last], top[q], bottom[p], rim_bottom[last], bottom[q]);
                const bool on_border = (k == 0 || k == 7)   ? column + 1 == columns
                                       : (k == 1 || k == 2) ? row + 1 == rows
                                       : (k == 3 || k == 4) ? column == 0
                                                            : row == 0;
                if (on_border) add_quad(mesh, top[p], top[q], bottom[q], bottom[p]);
            }
        }
}

void add_beam(TriangleMesh& mesh, const Pose& place, double half_width, double half_height, double length) {
    const double b = half_width, h = half_height, t = 0.16 * half_height, w = 0.09 * half_width;
    const std::array<Point2, 12> section = {
        {{b, -h}, {b, t - h}, {w, t - h}, {w, h - t}, {b, h - t}, {b, h}, {-b, h}, {-b, h - t}, {-w, h - t}, {-w, t - h}, {-b, t - h}, {-b, -h}}};
    constexpr size_t cap[10][3] = {{0, 1, 2}, {0, 2, 9}, {0, 9, 10}, {0, 10, 11}, {2, 3, 8}, {2, 8, 9}, {5, 6, 7}, {5, 7, 8}, {5, 8, 3}, {5, 3, 4}};
    const std::vector<uint32_t> top = add_loop(mesh, place, section, length), bottom = add_loop(mesh, place, section, 0);
    add_wall(mesh, top, bottom, true);
    const Faces faces{mesh};
    for (const auto& c : cap) faces.add(top[c[0]], top[c[2]], top[c[1]], bottom[c[0]], bottom[c[2]], bottom[c[1]]);
}

void add_bar(TriangleMesh& mesh, std::span<const Vector> path, double radius, uint32_t segments) {
    RAYPAGER_CHECK(path.size() >= 2 && segments >= 3);
    const std::vector<Point2> round = circle(1, segments);
    const size_t n = path.size();
    Vector normal = any_perpendicular(path[1] - path[0]);
    std::vector<uint32_t> before;
    for (size_t i = 0; i < n; i++) {
        const Vector tangent = unit(path[i + 1 < n ? i + 1 : i] - path[i > 0 ? i - 1 : 0]);
        normal = unit(normal - tangent * dot(normal, tangent));  // carried along with as little twist as possible
        const Vector binormal = cross(normal, tangent);
        std::vector<uint32_t> ring;
        ring.reserve(segments);
        for (const Point2& u : round) ring.push_back(add_vertex(mesh, path[i] + (normal * u[0] + binormal * u[1]) * radius));
        if (i == 0 || i + 1 == n) {
            const uint32_t centre = add_vertex(mesh, path[i]);
            for (uint32_t j = 0; j < segments; j++) {
                const uint32_t k = (j + 1) % segments;
                mesh.triangles.push_back(i == 0 ? Triangle{centre, ring[j], ring[k]} : Triangle{centre, ring[k], ring[j]});
            }
        }
        if (i > 0) add_wall(mesh, ring, before, true);
        before = std::move(ring);
    }
}

void add_cylinder(TriangleMesh& mesh, const Pose& place, double radius, double height, uint32_t segments) {
    const std::array<Point2, 4> profile = {{{0, 0}, {radius, 0}, {radius, height}, {0, height}}};
    add_turned(mesh, place, profile, segments, false);
}

void add_pipe(TriangleMesh& mesh, const Pose& place, double radius, double wall, double height, uint32_t segments) {
    const std::array<Point2, 4> profile = {{{radius - wall, 0}, {radius, 0}, {radius, height}, {radius - wall, height}}};
    add_turned(mesh, place, profile, segments, true);
}

void add_ball(TriangleMesh& mesh, const Pose& place, double radius, uint32_t segments) {
    const uint32_t rows = segments / 2 + 1;
    std::vector<Point2> profile;
    for (uint32_t i = 0; i <= rows; i++) {
        const SinCos angle = sincos_turns(0.5 * i / rows);
        profile.push_back({radius * angle.sin, -radius * angle.cos});
    }
    add_turned(mesh, place, profile, segments, false);
}

void add_torus(TriangleMesh& mesh, const Pose& place, double major, double minor, uint32_t segments, uint32_t minor_segments) {
    std::vector<Point2> profile = circle(minor, minor_segments);
    for (Point2& p : profile) p[0] += major;
    add_turned(mesh, place, profile, segments, true);
}

void add_bolt(TriangleMesh& mesh, const Pose& place, double radius, double shaft, uint32_t segments, uint32_t rings) {
    const double head = 1.8 * radius;
    const std::array<Point2, 5> hexagon = {{{0, 0}, {head, 0}, {head, 1.1 * radius}, {0.85 * head, 1.3 * radius}, {0, 1.3 * radius}}};
    add_turned(mesh, place, hexagon, 6, false);
    std::vector<Point2> profile = {{0, -shaft}};
    for (uint32_t i = 0; i <= 2 * rings; i++) profile.push_back({radius * (i % 2 == 0 ? 0.86 : 1), -shaft + 0.8 * shaft * i / (2 * rings)});
    profile.push_back({radius, -0.2 * shaft + 0.1 * radius});
    profile.push_back({radius, 0.2 * radius});  // into the head
    profile.push_back({0, 0.2 * radius});
    add_turned(mesh, place, profile, segments, false);
}

void add_gear(TriangleMesh& mesh, const Pose& place, double radius, uint32_t teeth, double bore, double height, uint32_t points_per_flank) {
    RAYPAGER_CHECK(teeth >= 3 && points_per_flank > 0);
    // A tooth: root, flank up, tip, flank down, in equal quarters of its pitch.
    const double depth = 2.2 * radius / teeth;
    std::vector<Point2> outer;
    const uint32_t points = 4 * points_per_flank;
    for (uint32_t i = 0; i < teeth * points; i++) {
        const double phase = static_cast<double>(i % points) / points;
        const double lift = smooth_step(0.22, 0.45, phase) * smooth_step(1.0, 0.77, phase);
        const SinCos angle = sincos_turns(static_cast<double>(i) / (teeth * points));
        const double r = radius - depth * (1 - lift);
        outer.push_back({r * angle.cos, r * angle.sin});
    }
    add_ring(mesh, place, outer, circle(bore, teeth * points), height);
}

void add_spring(TriangleMesh& mesh, const Pose& place, double radius, double wire, double height, uint32_t coils, uint32_t segments) {
    const uint32_t steps = coils * segments * 2;
    std::vector<Vector> path;
    for (uint32_t i = 0; i <= steps; i++) {
        const double t = static_cast<double>(i) / steps;
        const SinCos angle = sincos_turns(t * coils);
        path.push_back(place.at(radius * angle.cos, wire + (height - 2 * wire) * t, radius * angle.sin));
    }
    add_bar(mesh, path, wire, segments);
}

}  // namespace raypager
