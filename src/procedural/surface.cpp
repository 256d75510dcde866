#include "procedural/surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

constexpr uint64_t vertices_at_once = 1 << 17, triangles_at_once = 1 << 17;

// Vertex rows begin .. end of a grid, as one mesh.
class Band {
public:
    Band(const SurfaceGrid& grid, uint64_t begin, uint64_t end) : grid_(grid), begin_(begin), end_(end) {}

    uint64_t vertices() const { return first_index(end_ + 1); }
    uint64_t triangles() const { return grid_.columns * (2 * (end_ - begin_) - (is_pole(begin_) ? 1 : 0) - (is_pole(end_) ? 1 : 0)); }
    Status write(PlyWriter& writer) const {
        RAYPAGER_TRY(write_vertices(writer));
        return write_triangles(writer);
    }

private:
    bool is_pole(uint64_t row) const { return (row == 0 && grid_.first_is_pole) || (row == grid_.rows && grid_.last_is_pole); }
    // The last row is the first one again, in this very mesh.
    bool returns() const { return grid_.wraps_rows && begin_ == 0 && end_ == grid_.rows; }
    uint64_t row_vertices() const { return grid_.columns + (grid_.wraps_columns ? 0 : 1); }

    // Of the vertices of a row.
    uint64_t first_index(uint64_t row) const {
        if (row == begin_) return 0;
        if (returns() && row >= end_) return row == end_ ? 0 : (end_ - begin_) * row_vertices();
        uint64_t index = (row - begin_) * row_vertices();
        if (is_pole(begin_)) index -= row_vertices() - 1;
        if (row > end_ && is_pole(end_)) index -= row_vertices() - 1;
        return index;
    }
    uint32_t index(uint64_t row, uint64_t column) const {
        if (is_pole(row)) return static_cast<uint32_t>(first_index(row));
        return static_cast<uint32_t>(first_index(row) + (grid_.wraps_columns && column == grid_.columns ? 0 : column));
    }

    Status write_vertices(PlyWriter& writer) const {
        const uint64_t last = returns() ? end_ - 1 : end_;
        const uint64_t rows_at_once = std::max<uint64_t>(1, vertices_at_once / row_vertices());
        std::vector<Float3> positions;
        for (uint64_t from = begin_; from <= last; from += rows_at_once) {
            const uint64_t to = std::min(last + 1, from + rows_at_once);
            positions.resize(first_index_or_end(to) - first_index(from));
            parallel_for(to - from, 1, [&](size_t piece_begin, size_t piece_end) {
                for (uint64_t row = from + piece_begin; row < from + piece_end; row++)
                    fill_row(row, &positions[first_index(row) - first_index(from)]);
            });
            RAYPAGER_TRY(writer.add_vertices(positions));
        }
        return {};
    }
    // As first_index, but for the row that returns to the first one: behind all others.
    uint64_t first_index_or_end(uint64_t row) const { return returns() && row == end_ ? vertices() : first_index(row); }

    void fill_row(uint64_t row, Float3* to) const {
        const uint64_t source = grid_.wraps_rows && row == grid_.rows ? 0 : row;
        const uint64_t count = is_pole(row) ? 1 : row_vertices();
        for (uint64_t column = 0; column < count; column++) to[column] = float3(grid_.position(source, column));
    }

    Status write_triangles(PlyWriter& writer) const {
        std::vector<Triangle> triangles;
        for (uint64_t row = begin_; row < end_; row++)
            for (uint64_t column = 0; column < grid_.columns; column++) {
                const uint32_t a = index(row, column), b = index(row, column + 1), d = index(row + 1, column), e = index(row + 1, column + 1);
                if (!is_pole(row)) triangles.push_back({a, d, b});
                if (!is_pole(row + 1)) triangles.push_back({b, d, e});
                if (triangles.size() < triangles_at_once) continue;
                RAYPAGER_TRY(writer.add_triangles(triangles));
                triangles.clear();
            }
        return writer.add_triangles(triangles);
    }

    const SurfaceGrid& grid_;
    uint64_t begin_, end_;
};

// A Catmull-Rom curve through points, at s in [0, 1]; ends are doubled.
std::array<double, 2> curve_point(const std::vector<std::array<double, 2>>& points, double s) {
    const double at = s * static_cast<double>(points.size() - 1);
    const auto i = std::min(static_cast<size_t>(at), points.size() - 2);
    const double t = at - static_cast<double>(i);
    const auto &p0 = points[i > 0 ? i - 1 : 0], &p1 = points[i], &p2 = points[i + 1], &p3 = points[std::min(i + 2, points.size() - 1)];
    std::array<double, 2> result{};
    for (size_t k = 0; k < 2; k++)
        result[k] =
            0.5 * (2 * p1[k] + t * (p2[k] - p0[k] + t * (2 * p0[k] - 5 * p1[k] + 4 * p2[k] - p3[k] + t * (3 * p1[k] - p0[k] - 3 * p2[k] + p3[k]))));
    return result;
}

// A vertex of the lattice on the surface of a cube of n^3 cells, on the unit sphere. The polynomial evens out the triangles' sizes.
Vector cube_direction(const std::array<uint64_t, 3>& lattice, uint64_t n) {
    Vector p{};
    for (size_t k = 0; k < 3; k++) {
        const double u = (2.0 * static_cast<double>(lattice[k]) - static_cast<double>(n)) / static_cast<double>(n);
        p[k] = u * (0.75 + 0.25 * u * u);
    }
    return unit(p);
}

}  // namespace

Status write_surface(SceneWriter& scene, std::string_view name, std::string_view material, const SurfaceGrid& grid, uint64_t max_triangles) {
    RAYPAGER_CHECK(grid.rows >= (grid.wraps_rows ? 3 : 1) && grid.columns >= (grid.wraps_columns ? 3 : 1));
    const uint64_t bands = std::min(grid.rows, (grid.triangles() + max_triangles - 1) / max_triangles);
    for (uint64_t i = 0; i < bands; i++) {
        const Band band(grid, grid.rows * i / bands, grid.rows * (i + 1) / bands);
        const std::string file = fmt::format("{}-{}", name, i);
        auto writer = scene.begin_mesh(file, band.vertices(), band.triangles());
        if (!writer) return writer.status();
        RAYPAGER_TRY(band.write(*writer));
        RAYPAGER_TRY(scene.finish_mesh(file, material, *writer));
    }
    return {};
}

std::vector<SurfaceGrid> displaced_sphere(uint64_t n, const Vector& center, const std::function<double(const Vector&)>& radius) {
    std::vector<SurfaceGrid> faces;
    for (size_t axis = 0; axis < 3; axis++)
        for (const bool far_side : {false, true}) {
            SurfaceGrid face;
            face.rows = face.columns = n;
            face.position = [=](uint64_t row, uint64_t column) {
                std::array<uint64_t, 3> lattice{};
                lattice[axis] = far_side ? n : 0;
                // Columns and rows swap roles on opposite faces, so that both are seen from outside.
                lattice[(axis + 1) % 3] = far_side ? row : column;
                lattice[(axis + 2) % 3] = far_side ? column : row;
                const Vector direction = cube_direction(lattice, n);
                return center + direction * radius(direction);
            };
            faces.push_back(std::move(face));
        }
    return faces;
}

SurfaceGrid knot_surface(TorusKnot knot) {
    SurfaceGrid grid;
    grid.rows = knot.rows;
    grid.columns = knot.columns;
    grid.wraps_rows = grid.wraps_columns = true;
    grid.position = [knot = std::move(knot)](uint64_t row, uint64_t column) {
        const double along = static_cast<double>(row) / static_cast<double>(knot.rows);
        const double around = static_cast<double>(column) / static_cast<double>(knot.columns);
        const SinCos a = sincos_turns(along * knot.windings), b = sincos_turns(along * knot.turns), c = sincos_turns(around);
        const double ring = knot.major + knot.minor * b.cos;
        const Vector outwards = {b.cos * a.cos, b.cos * a.sin, b.sin};  // from the core circle
        const Vector at = {ring * a.cos, ring * a.sin, knot.minor * b.sin};
        const double p = knot.windings, q = knot.turns * knot.minor;
        const Vector tangent = unit({-q * b.sin * a.cos - p * ring * a.sin, -q * b.sin * a.sin + p * ring * a.cos, q * b.cos});
        const Vector normal = unit(outwards - tangent * dot(outwards, tangent));
        const Vector binormal = cross(normal, tangent);
        return knot.center + at + (normal * c.cos + binormal * c.sin) * knot.thickness(along, around);
    };
    return grid;
}

SurfaceGrid turned_surface(Turned turned) {
    RAYPAGER_CHECK(turned.profile.size() >= 2 && turned.profile.front()[0] == 0 && turned.profile.back()[0] == 0);
    SurfaceGrid grid;
    grid.rows = turned.rows;
    grid.columns = turned.columns;
    grid.wraps_columns = grid.first_is_pole = grid.last_is_pole = true;
    grid.position = [turned = std::move(turned)](uint64_t row, uint64_t column) {
        const double along = static_cast<double>(row) / static_cast<double>(turned.rows);
        const double around = static_cast<double>(column) / static_cast<double>(turned.columns);
        const bool pole = row == 0 || row == turned.rows;
        const auto [radius, height] = curve_point(turned.profile, along);
        const double r = pole ? 0 : radius + turned.relief(along, around);
        const SinCos angle = sincos_turns(around);
        return turned.base + Vector{r * angle.cos, height, r * angle.sin};
    };
    return grid;
}

}  // namespace raypager
