#include "import/tessellate.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "scene/vector.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

constexpr uint32_t around = 256;     // steps of a full turn
constexpr uint32_t from_pole = 128;  // steps from pole to pole

Float3 rounded(double x, double y, double z) { return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)}; }

// Columns of two vertices each, joined to the next column by two triangles. A full turn closes exactly: the last column is the first, or lies where
// that does and has other coordinates of textures.
template <class Column>
TriangleMesh sweep_columns(double sweep, bool uvs, const Column& column) {
    const bool closed = sweep >= 2 * pi;
    TriangleMesh mesh;
    const uint32_t columns = closed && !uvs ? around : around + 1;
    for (uint32_t i = 0; i < columns; ++i) {
        const double angle = closed && i == around ? 0 : sweep * i / around;
        column(std::cos(angle), std::sin(angle), mesh);
        const auto u = static_cast<float>(double(i) / around);
        if (uvs) mesh.uvs.insert(mesh.uvs.end(), {{u, 0}, {u, 1}});
    }
    for (uint32_t i = 0; i < around; ++i) {
        const uint32_t a = 2 * i, b = 2 * ((i + 1) % columns);
        mesh.triangles.push_back({a, b, b + 1});
        mesh.triangles.push_back({a, b + 1, a + 1});
    }
    return mesh;
}

void add(TriangleMesh& mesh, const Float3& position, const Float3& normal) {
    mesh.positions.push_back(position);
    mesh.normals.push_back(normal);
}

// A point of a line that is turned about z, its derivative along the line, and its coordinate of textures.
struct LinePoint {
    Vector position, along;
    double v;
};

// What a line sweeps out, `rows` steps along it. Its normals are along sweep x line, as pbrt has them.
TriangleMesh revolve(const std::function<LinePoint(double)>& line, uint32_t rows, double sweep, bool uvs) {
    const bool closed = sweep >= 2 * pi;
    const uint32_t steps = std::max(1u, static_cast<uint32_t>(std::ceil(around * sweep / (2 * pi)))), columns = closed && !uvs ? steps : steps + 1;
    TriangleMesh mesh;
    for (uint32_t j = 0; j <= rows; ++j) {
        const LinePoint point = line(double(j) / rows);
        const Vector& p = point.position;
        const bool on_axis = std::hypot(p[0], p[1]) == 0;
        // Near the axis the sweep has the direction that it has a little farther along the line.
        const Vector& beside = on_axis ? line(j == 0 ? 0.5 / rows : (j - 0.5) / rows).position : p;
        Vector normal = cross({-beside[1], beside[0], 0}, point.along);
        normal = length(normal) > 0 ? unit(normal) : Vector{0, 0, 1};
        for (uint32_t i = 0; i < columns; ++i) {
            const double angle = closed && i == steps ? 0 : sweep * i / steps, c = std::cos(angle), s = std::sin(angle);
            add(mesh, rounded(c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]),
                rounded(c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], normal[2]));
            if (uvs) mesh.uvs.push_back({static_cast<float>(double(i) / steps), static_cast<float>(point.v)});
        }
    }
    const auto is_on_axis = [&](uint32_t j) { return mesh.positions[size_t{j} * columns].x == 0 && mesh.positions[size_t{j} * columns].y == 0; };
    for (uint32_t j = 0; j < rows; ++j)
        for (uint32_t i = 0; i < steps; ++i) {
            const uint32_t a = j * columns + i, b = j * columns + (i + 1) % columns;
            if (!is_on_axis(j)) mesh.triangles.push_back({a, b, b + columns});
            if (!is_on_axis(j + 1)) mesh.triangles.push_back({a, b + columns, a + columns});
            // On the axis each vertex is of one triangle, which is as wide as a step there as well.
            const auto middle = static_cast<float>((i + 0.5) / steps);
            if (uvs && is_on_axis(j)) mesh.uvs[a].x = middle;
            if (uvs && is_on_axis(j + 1)) mesh.uvs[b + columns].x = middle;
        }
    return mesh;
}

Vector lerp(const Vector& a, const Vector& b, uint32_t i, uint32_t n) { return 1.0 / n * (double(n - i) * a + double(i) * b); }

}  // namespace

TriangleMesh tessellate_sphere(double radius, bool uvs) {
    if (uvs) return tessellate_partial_sphere(radius, -radius, radius, 2 * pi, true);
    TriangleMesh mesh;
    add(mesh, rounded(0, 0, radius), {0, 0, 1});
    for (uint32_t j = 1; j < from_pole; ++j)
        for (uint32_t i = 0; i < around; ++i) {
            const double theta = pi * j / from_pole, phi = 2 * pi * i / around;
            const double x = std::sin(theta) * std::cos(phi), y = std::sin(theta) * std::sin(phi), z = std::cos(theta);
            add(mesh, rounded(radius * x, radius * y, radius * z), rounded(x, y, z));
        }
    add(mesh, rounded(0, 0, -radius), {0, 0, -1});
    const auto vertex = [](uint32_t j, uint32_t i) { return 1 + (j - 1) * around + i % around; };
    const auto south = static_cast<uint32_t>(mesh.positions.size() - 1);
    for (uint32_t i = 0; i < around; ++i) {
        mesh.triangles.push_back({0, vertex(1, i), vertex(1, i + 1)});
        for (uint32_t j = 1; j + 1 < from_pole; ++j) {
            mesh.triangles.push_back({vertex(j, i), vertex(j + 1, i), vertex(j + 1, i + 1)});
            mesh.triangles.push_back({vertex(j, i), vertex(j + 1, i + 1), vertex(j, i + 1)});
        }
        mesh.triangles.push_back({vertex(from_pole - 1, i), south, vertex(from_pole - 1, i + 1)});
    }
    return mesh;
}

TriangleMesh tessellate_disk(double height, double radius, double inner_radius, double sweep, bool uvs) {
    TriangleMesh mesh = sweep_columns(sweep, uvs, [&](double c, double s, TriangleMesh& to) {
        add(to, rounded(radius * c, radius * s, height), {0, 0, 1});
        add(to, rounded(inner_radius * c, inner_radius * s, height), {0, 0, 1});
    });
    if (inner_radius > 0) return mesh;
    // Without a hole, the inner vertices coincide, and every second triangle has no area.
    for (size_t i = 0; 2 * i < mesh.triangles.size(); ++i) {
        mesh.triangles[i] = mesh.triangles[2 * i];
        if (uvs) mesh.uvs[mesh.triangles[i][2]].x = static_cast<float>((double(i) + 0.5) / around);  // as on other axes
    }
    mesh.triangles.resize(mesh.triangles.size() / 2);
    return mesh;
}

TriangleMesh tessellate_partial_sphere(double radius, double z_min, double z_max, double sweep, bool uvs) {
    const double first = std::acos(std::clamp(z_min / radius, -1.0, 1.0)), last = std::acos(std::clamp(z_max / radius, -1.0, 1.0));
    const auto rows = static_cast<uint32_t>(std::ceil(from_pole * (first - last) / pi));
    return revolve(
        [&](double v) -> LinePoint {
            const double theta = first + v * (last - first);
            // The poles lie on the axis, not next to it.
            const double s = theta == pi ? 0 : std::sin(theta), c = std::cos(theta);
            return {{radius * s, 0, radius * c}, {-c, 0, s}, v};
        },
        std::max(1u, rows), sweep, uvs);
}

TriangleMesh tessellate_cylinder(double radius, double z_min, double z_max, double sweep, bool uvs) {
    return sweep_columns(sweep, uvs, [&](double c, double s, TriangleMesh& to) {
        add(to, rounded(radius * c, radius * s, z_min), rounded(c, s, 0));
        add(to, rounded(radius * c, radius * s, z_max), rounded(c, s, 0));
    });
}

TriangleMesh tessellate_cone(double radius, double height, double sweep, bool uvs) {
    return revolve([&](double v) -> LinePoint { return {{(1 - v) * radius, 0, v * height}, {-radius, 0, height}, v}; }, 1, sweep, uvs);
}

TriangleMesh tessellate_paraboloid(double radius, double z_min, double z_max, double sweep, bool uvs) {
    const double first = radius * std::sqrt(z_min / z_max);
    return revolve(
        [&](double v) -> LinePoint {
            const double r = first + v * (radius - first);
            const double z = z_max * (r / radius) * (r / radius);
            return {{r, 0, z}, {1, 0, 2 * z_max * r / (radius * radius)}, (z - z_min) / (z_max - z_min)};
        },
        64, sweep, uvs);
}

TriangleMesh tessellate_hyperboloid(const std::array<double, 3>& from, const std::array<double, 3>& to, double sweep, bool uvs) {
    return revolve([&](double v) -> LinePoint { return {(1 - v) * from + v * to, to - from, v}; }, 64, sweep, uvs);
}

namespace {

class Patches {
public:
    explicit Patches(const PatchMesh& mesh)
        : positions_(mesh.positions), normals_(mesh.normals), uvs_(mesh.uvs), patches_(mesh.patches), own_uvs_(mesh.own_uvs && mesh.uvs.empty()) {
        double most = 0;
        for (const Patch& patch : patches_) most = std::max(most, steps_for(patch));
        // So many that the number of triangles stays within bounds.
        const double possible =
            std::sqrt(static_cast<double>(max_patch_triangles) / (2.0 * static_cast<double>(std::max<size_t>(patches_.size(), 1))));
        steps_ = static_cast<uint32_t>(std::clamp(std::ceil(most), 1.0, std::max(1.0, std::floor(possible))));
    }

    TriangleMesh make() const {
        if (steps_ == 1) return own_uvs_ ? make_flat_alone() : make_flat();
        TriangleMesh mesh;
        for (const Patch& patch : patches_)
            if (are_there(patch)) add_patch(patch, mesh);
        return mesh;
    }

private:
    bool are_there(const Patch& patch) const {
        return std::all_of(patch.begin(), patch.end(), [&](uint32_t i) { return i < positions_.size() && finite(positions_[i]); });
    }
    Vector corner(const Patch& patch, size_t i) const { return vector(positions_[patch[i]]); }

    // Two triangles are off by at most a quarter of how far the corners are from a parallelogram, as far as that leaves their plane; n * n times two
    // by an n-th of an n-th of it.
    double steps_for(const Patch& patch) const {
        if (!are_there(patch)) return 1;
        const Vector p00 = corner(patch, 0), p10 = corner(patch, 1), p01 = corner(patch, 2), p11 = corner(patch, 3);
        const Vector normal = cross(p11 - p00, p01 - p10);
        const double side = std::max({length(p10 - p00), length(p01 - p00), length(p11 - p10), length(p11 - p01)});
        if (!(length(normal) > 0) || !(side > 0)) return 1;
        return std::sqrt(std::abs(dot(p00 - p10 - p01 + p11, unit(normal))) / (4 * patch_error * side));
    }

    TriangleMesh make_flat() const {
        TriangleMesh mesh;
        mesh.positions = positions_;
        mesh.normals = normals_;
        mesh.uvs = uvs_;
        for (const Patch& p : patches_) {
            mesh.triangles.push_back({p[0], p[1], p[3]});
            mesh.triangles.push_back({p[0], p[3], p[2]});
        }
        return mesh;
    }

    // Each patch with vertices of its own.
    TriangleMesh make_flat_alone() const {
        TriangleMesh mesh;
        for (const Patch& p : patches_) {
            if (!are_there(p)) continue;
            const auto first = static_cast<uint32_t>(mesh.positions.size());
            for (const uint32_t i : p) {
                mesh.positions.push_back(positions_[i]);
                if (!normals_.empty()) mesh.normals.push_back(normals_[i]);
            }
            mesh.uvs.insert(mesh.uvs.end(), {{0, 0}, {1, 0}, {0, 1}, {1, 1}});
            mesh.triangles.push_back({first, first + 1, first + 3});
            mesh.triangles.push_back({first, first + 3, first + 2});
        }
        return mesh;
    }

    Float2 uv_at(const Patch& patch, double s, double t) const {
        if (own_uvs_) return {static_cast<float>(s), static_cast<float>(t)};
        const auto between = [&](float Float2::*axis) {
            const auto given = [&](size_t k) { return double(uvs_[patch[k]].*axis); };
            return static_cast<float>((1 - t) * ((1 - s) * given(0) + s * given(1)) + t * ((1 - s) * given(2) + s * given(3)));
        };
        return {between(&Float2::x), between(&Float2::y)};
    }

    // Points on the sides are the same for both patches that share them, to the bit.
    void add_patch(const Patch& patch, TriangleMesh& mesh) const {
        const uint32_t n = steps_, first = static_cast<uint32_t>(mesh.positions.size());
        const Vector p00 = corner(patch, 0), p10 = corner(patch, 1), p01 = corner(patch, 2), p11 = corner(patch, 3);
        for (uint32_t j = 0; j <= n; ++j)
            for (uint32_t i = 0; i <= n; ++i) {
                const Vector position =
                    i == 0 || i == n ? lerp(i == 0 ? p00 : p10, i == 0 ? p01 : p11, j, n) : lerp(lerp(p00, p10, i, n), lerp(p01, p11, i, n), j, n);
                Vector normal = cross(lerp(p10 - p00, p11 - p01, j, n), lerp(p01 - p00, p11 - p10, i, n));
                if (!normals_.empty()) {
                    const auto given = [&](size_t k) { return vector(normals_[patch[k]]); };
                    normal = lerp(lerp(given(0), given(1), i, n), lerp(given(2), given(3), i, n), j, n);
                }
                if (!(length(normal) > 0)) normal = cross(p11 - p00, p01 - p10);
                add(mesh, float3(position), length(normal) > 0 ? float3(unit(normal)) : Float3{0, 0, 1});
                if (own_uvs_ || !uvs_.empty()) mesh.uvs.push_back(uv_at(patch, double(i) / n, double(j) / n));
            }
        for (uint32_t j = 0; j < n; ++j)
            for (uint32_t i = 0; i < n; ++i) {
                const uint32_t a = first + j * (n + 1) + i;
                mesh.triangles.push_back({a, a + 1, a + n + 2});
                mesh.triangles.push_back({a, a + n + 2, a + n + 1});
            }
    }

    const std::vector<Float3>&positions_, &normals_;
    const std::vector<Float2>& uvs_;
    const std::vector<Patch>& patches_;
    const bool own_uvs_;
    uint32_t steps_ = 1;
};

}  // namespace

TriangleMesh tessellate_patches(const PatchMesh& mesh) { return Patches(mesh).make(); }

}  // namespace raypager
