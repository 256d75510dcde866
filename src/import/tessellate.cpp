#include "import/tessellate.hpp"

#include <cmath>
#include <numbers>

namespace raypager {
namespace {

using std::numbers::pi;

constexpr uint32_t around = 256;     // steps of a full turn
constexpr uint32_t from_pole = 128;  // steps from pole to pole

Float3 float3(double x, double y, double z) { return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)}; }

// Columns of two vertices each, joined to the next column by two triangles. A full turn closes exactly: the last column is the first.
template <class Column>
TriangleMesh sweep_columns(double sweep, const Column& column) {
    const bool closed = sweep >= 2 * pi;
    TriangleMesh mesh;
    const uint32_t columns = closed ? around : around + 1;
    for (uint32_t i = 0; i < columns; ++i) column(std::cos(sweep * i / around), std::sin(sweep * i / around), mesh);
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

}  // namespace

TriangleMesh tessellate_sphere(double radius) {
    TriangleMesh mesh;
    add(mesh, float3(0, 0, radius), {0, 0, 1});
    for (uint32_t j = 1; j < from_pole; ++j)
        for (uint32_t i = 0; i < around; ++i) {
            const double theta = pi * j / from_pole, phi = 2 * pi * i / around;
            const double x = std::sin(theta) * std::cos(phi), y = std::sin(theta) * std::sin(phi), z = std::cos(theta);
            add(mesh, float3(radius * x, radius * y, radius * z), float3(x, y, z));
        }
    add(mesh, float3(0, 0, -radius), {0, 0, -1});
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

TriangleMesh tessellate_disk(double height, double radius, double inner_radius, double sweep) {
    TriangleMesh mesh = sweep_columns(sweep, [&](double c, double s, TriangleMesh& to) {
        add(to, float3(radius * c, radius * s, height), {0, 0, 1});
        add(to, float3(inner_radius * c, inner_radius * s, height), {0, 0, 1});
    });
    if (inner_radius > 0) return mesh;
    // Without a hole, the inner vertices coincide, and every second triangle has no area.
    for (size_t i = 0; 2 * i < mesh.triangles.size(); ++i) mesh.triangles[i] = mesh.triangles[2 * i];
    mesh.triangles.resize(mesh.triangles.size() / 2);
    return mesh;
}

TriangleMesh tessellate_cylinder(double radius, double z_min, double z_max, double sweep) {
    return sweep_columns(sweep, [&](double c, double s, TriangleMesh& to) {
        add(to, float3(radius * c, radius * s, z_min), float3(c, s, 0));
        add(to, float3(radius * c, radius * s, z_max), float3(c, s, 0));
    });
}

}  // namespace raypager
