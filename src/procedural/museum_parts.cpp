#include "procedural/museum_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "procedural/noise.hpp"

namespace raypager {
namespace {

constexpr uint64_t grid_file_triangles = 1 << 19;  // what is in memory at once

uint32_t add_uv_vertex(TriangleMesh& mesh, const Vector& p, double u, double v) {
    mesh.positions.push_back(float3(p));
    mesh.uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
    return static_cast<uint32_t>(mesh.positions.size() - 1);
}

// Rows of vertices begin to end of a grid.
void add_grid_rows(TriangleMesh& mesh, const UvGrid& grid, uint64_t begin, uint64_t end) {
    const size_t first = mesh.positions.size(), stride = grid.columns + 1;
    mesh.positions.resize(first + (end - begin + 1) * stride);
    mesh.uvs.resize(mesh.positions.size());
    parallel_for(end - begin + 1, 16, [&](size_t from, size_t to) {
        for (size_t row = from; row < to; row++)
            for (size_t column = 0; column < stride; column++) {
                const double v = static_cast<double>(begin + row) / static_cast<double>(grid.rows);
                const double u = static_cast<double>(column) / static_cast<double>(grid.columns);
                mesh.positions[first + row * stride + column] = float3(grid.position(u, v));
                mesh.uvs[first + row * stride + column] = {static_cast<float>(u * grid.u_repeats), static_cast<float>(v * grid.v_repeats)};
            }
    });
    for (uint64_t row = begin; row < end; row++)
        for (uint64_t column = 0; column < grid.columns; column++) {
            const auto a = static_cast<uint32_t>(first + (row - begin) * stride + column), d = static_cast<uint32_t>(a + stride);
            // u turns from z to x, so that with v upwards the outside is in front.
            if (!(grid.pole_below && row == 0)) mesh.triangles.push_back({a, a + 1, d + 1});
            if (!(grid.pole_above && row + 1 == grid.rows)) mesh.triangles.push_back({a, d + 1, d});
        }
}

// Rows and columns of quads so that there are about so many triangles; around and up are the lengths that they divide.
void divide_grid(UvGrid& grid, uint64_t triangles, double around, double up) {
    const double quads = std::max(1.0, static_cast<double>(triangles) / 2);
    grid.columns = std::max<uint64_t>(4, static_cast<uint64_t>(std::sqrt(quads * around / up)));
    grid.rows = std::max<uint64_t>(2, static_cast<uint64_t>(std::llround(static_cast<double>(quads) / static_cast<double>(grid.columns))));
}

Vector turned(const Vector& base, double radius, double turns, double height) {
    const SinCos angle = sincos_turns(turns);
    return base + Vector{radius * angle.sin, height, radius * angle.cos};
}

// Values at equal steps of v, between which a smooth curve goes (Catmull and Rom's), never below 0.
double outline(std::span<const double> values, double v) {
    const double at = v * static_cast<double>(values.size() - 1);
    const size_t i = std::min(static_cast<size_t>(at), values.size() - 2);
    const double t = at - static_cast<double>(i);
    const double a = values[i > 0 ? i - 1 : 0], b = values[i], c = values[i + 1], d = values[std::min(i + 2, values.size() - 1)];
    return std::max(0.0, 0.5 * (2 * b + t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * b - a - 3 * c + d)))));
}

}  // namespace

void append_mesh(TriangleMesh& mesh, const TriangleMesh& part) {
    const auto base = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
    mesh.uvs.insert(mesh.uvs.end(), part.uvs.begin(), part.uvs.end());
    for (const Triangle& t : part.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

void add_panel(TriangleMesh& mesh, const Vector& corner, const Vector& right, const Vector& up, double u_repeats, double v_repeats) {
    const uint32_t a = add_uv_vertex(mesh, corner, 0, 0);
    add_uv_vertex(mesh, corner + right, u_repeats, 0);
    add_uv_vertex(mesh, corner + right + up, u_repeats, v_repeats);
    add_uv_vertex(mesh, corner + up, 0, v_repeats);
    mesh.triangles.push_back({a, a + 1, a + 2});
    mesh.triangles.push_back({a, a + 2, a + 3});
}

void add_block(TriangleMesh& mesh, const Pose& place, double width, double height, double depth) {
    const double x = 0.5 * width, z = 0.5 * depth;
    const Vector up = place.y * height;
    add_panel(mesh, place.at(-x, 0, z), place.x * width, up, width, height);
    add_panel(mesh, place.at(x, 0, -z), place.x * -width, up, width, height);
    add_panel(mesh, place.at(x, 0, z), place.z * -depth, up, depth, height);
    add_panel(mesh, place.at(-x, 0, -z), place.z * depth, up, depth, height);
    add_panel(mesh, place.at(-x, height, z), place.x * width, place.z * -depth, width, depth);
}

void add_frame(TriangleMesh& mesh, const Pose& place, double width, double height, bool fine) {
    // How far outside of the picture, and how far off the wall.
    static constexpr std::array<Point2, 5> moulding = {{{-0.01, 0.022}, {0.025, 0.05}, {0.055, 0.036}, {0.085, 0.07}, {0.105, 0}}};
    static constexpr std::array<Point2, 2> bevel = {{{-0.01, 0.065}, {0.1, 0}}};
    const std::span<const Point2> profile = fine ? std::span<const Point2>(moulding) : bevel;
    const std::array<Point2, 4> corners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    const std::array<Point2, 4> outwards = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
    for (size_t side = 0; side < 4; side++) {
        const double along = side % 2 == 0 ? width : height;
        for (size_t i = 0; i + 1 < profile.size(); i++) {
            std::array<uint32_t, 4> at{};
            for (size_t k = 0; k < 4; k++) {
                const size_t corner = (side + (k == 1 || k == 2 ? 1 : 0)) % 4;
                const auto [out, off] = profile[k < 2 ? i + 1 : i];
                const double x = corners[corner][0] * width + outwards[corner][0] * out, y = corners[corner][1] * height + outwards[corner][1] * out;
                at[k] = add_uv_vertex(mesh, place.at(x, y, off), (k == 1 || k == 2 ? along : 0) * 2, out * 8);
            }
            mesh.triangles.push_back({at[0], at[1], at[2]});
            mesh.triangles.push_back({at[0], at[2], at[3]});
        }
    }
}

void add_grid(TriangleMesh& mesh, const UvGrid& grid) { add_grid_rows(mesh, grid, 0, grid.rows); }

Status write_grid(SceneWriter& scene, std::string_view name, std::string_view material, const UvGrid& grid) {
    const uint64_t bands = std::min(grid.rows, grid.triangles() / grid_file_triangles + 1);
    TriangleMesh mesh;
    for (uint64_t i = 0; i < bands; i++) {
        mesh.positions.clear();
        mesh.uvs.clear();
        mesh.triangles.clear();
        add_grid_rows(mesh, grid, grid.rows * i / bands, grid.rows * (i + 1) / bands);
        RAYPAGER_TRY(scene.textured_mesh(fmt::format("{}-{}", name, i), material, mesh));
    }
    return {};
}

UvGrid statue_grid(const Vector& base, double height, uint64_t triangles, uint64_t seed) {
    Random random(seed, 31);
    static constexpr std::array<std::array<double, 9>, 4> outlines = {{{0.02, 0.62, 0.86, 0.97, 1, 0.97, 0.86, 0.62, 0.002},
                                                                       {0.3, 0.95, 0.8, 0.72, 0.68, 0.62, 0.6, 0.7, 0.002},
                                                                       {0.3, 0.45, 0.9, 1.05, 0.85, 0.5, 0.4, 0.62, 0.5},
                                                                       {0.4, 0.75, 0.6, 0.42, 0.62, 0.8, 0.35, 0.5, 0.002}}};
    const uint32_t kind = random.below(4);
    const double radius = height * (kind == 0 ? 0.5 : 0.28), twist = kind == 1 ? random.uniform(0.6, 1.6) : random.uniform(-0.3, 0.3);
    const double lobes = 3 + random.below(4), depth = kind == 1 ? 0.22 : random.uniform(0.03, 0.12), lumps = random.uniform(0.1, 0.4);
    const double frequency = random.uniform(1.2, 3);
    UvGrid grid;
    grid.u_repeats = 2;
    grid.pole_below = true;
    grid.pole_above = kind != 2;
    divide_grid(grid, triangles, 6.28 * 0.8 * radius, height);
    grid.position = [=](double u, double v) {
        const std::array<double, 9>& radii = outlines[kind];
        // At the poles, where all of a row is one point, nothing may depend on u.
        const bool pole = v == 0 || (v == 1 && kind != 2);
        const double r = pole ? 0 : radius * outline(radii, v);
        const double around = u == 1 ? 0 : u;  // so that the seam closes exactly
        const double bulge = 1 + depth * sincos_turns(lobes * (around + twist * v)).sin;
        const Vector p = turned(base, r * bulge, around, v * height);
        const Vector from_base = (frequency / height) * (p - base);
        return pole ? p : turned(base, r * bulge * (1 + lumps * fractal_noise(from_base, 4, 0.5, seed)), around, v * height);
    };
    return grid;
}

UvGrid column_grid(const Vector& base, double radius, double height, uint64_t triangles) {
    UvGrid grid;
    grid.v_repeats = 2;
    divide_grid(grid, triangles, 4 * 6.28 * radius, height);
    const double flutes = grid.columns >= 48 ? 16 : 0;
    grid.position = [=](double u, double v) {
        constexpr std::array<double, 17> radii = {1.5, 1.2, 1, 1, 1, 1, 1, 1, 0.98, 0.97, 0.96, 0.95, 0.94, 0.93, 0.92, 1.1, 1.5};
        const double shaft = v > 0.13 && v < 0.86 ? 0.035 : 0;
        const double groove = flutes == 0 ? 1 : 1 - shaft * (1 + sincos_turns(flutes * u).sin);
        return turned(base, radius * outline(radii, v) * groove, u == 1 ? 0 : u, v * height);
    };
    return grid;
}

UvGrid pot_grid(const Vector& base, double radius, double height, uint64_t triangles) {
    UvGrid grid;
    grid.pole_above = true;
    divide_grid(grid, triangles, 6.28 * radius, 2 * height);
    grid.position = [=](double u, double v) {
        // Up outside, over the rim, down to the earth and to its middle.
        constexpr std::array<double, 9> radii = {0.62, 0.74, 0.84, 0.9, 0.95, 1.08, 0.92, 0.5, 0},
                                        heights = {0, 0.25, 0.5, 0.75, 0.88, 1, 0.9, 0.88, 0.88};
        return turned(base, v == 1 ? 0 : radius * outline(radii, v), u == 1 ? 0 : u, height * outline(heights, v));
    };
    return grid;
}

void add_leaves(TriangleMesh& mesh, const Vector& base, double size, uint32_t leaves, uint32_t segments, Random& random) {
    for (uint32_t leaf = 0; leaf < leaves; leaf++) {
        const double turn = (leaf + random.uniform(-0.3, 0.3)) * 0.381966, length = size * random.uniform(0.7, 1.15);
        const double rise = random.uniform(0.5, 1.25), droop = random.uniform(0.5, 1.1), half_width = 0.17 * length;
        const SinCos angle = sincos_turns(turn);
        const Vector out = {angle.cos, 0, angle.sin}, across = {-angle.sin, 0, angle.cos};
        uint32_t last = 0;
        for (uint32_t i = 0; i <= segments; i++) {
            const double t = static_cast<double>(i) / segments;
            const Vector middle = base + out * (length * 0.75 * t) + Vector{0, length * (rise * t - droop * t * t), 0};
            const uint32_t left = add_uv_vertex(mesh, middle - across * half_width, 0, t);
            add_uv_vertex(mesh, middle + across * half_width, 1, t);
            if (i > 0) {
                mesh.triangles.push_back({last, last + 1, left + 1});
                mesh.triangles.push_back({last, left + 1, left});
            }
            last = left;
        }
    }
}

}  // namespace raypager
