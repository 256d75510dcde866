#include "reference/mesh_shapes.hpp"

#include <map>
#include <utility>

#include "base/check.hpp"

namespace raypager::reference {
namespace {

// The vertex in the middle of the edge a-b, on the unit sphere; made once an edge, so that the sphere stays closed.
uint32_t middle(uint32_t a, uint32_t b, std::vector<Vec3>& vertices, std::map<std::pair<uint32_t, uint32_t>, uint32_t>& made) {
    const auto [at, is_new] = made.try_emplace(std::minmax(a, b), static_cast<uint32_t>(vertices.size()));
    if (is_new) vertices.push_back(normalized(vertices[a] + vertices[b]));
    return at->second;
}

void subdivide(std::vector<Vec3>& vertices, std::vector<Triangle>& triangles) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> made;
    std::vector<Triangle> finer;
    for (const Triangle& t : triangles) {
        const uint32_t ab = middle(t[0], t[1], vertices, made), bc = middle(t[1], t[2], vertices, made), ca = middle(t[2], t[0], vertices, made);
        finer.push_back({t[0], ab, ca});
        finer.push_back({t[1], bc, ab});
        finer.push_back({t[2], ca, bc});
        finer.push_back({ab, bc, ca});
    }
    triangles = std::move(finer);
}

}  // namespace

TriangleMesh patch(uint32_t columns, uint32_t rows, const std::function<Vec3(double s, double t)>& point) {
    TriangleMesh mesh;
    for (uint32_t row = 0; row <= rows; row++) {
        for (uint32_t column = 0; column <= columns; column++)
            mesh.positions.push_back(point(double(column) / columns, double(row) / rows).to_float());
    }
    for (uint32_t row = 0; row < rows; row++) {
        for (uint32_t column = 0; column < columns; column++) {
            const uint32_t a = row * (columns + 1) + column, b = a + 1, c = a + columns + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    }
    return mesh;
}

TriangleMesh quad(const Vec3& corner, const Vec3& edge_s, const Vec3& edge_t, uint32_t divisions) {
    return patch(divisions, divisions, [&](double s, double t) { return corner + s * edge_s + t * edge_t; });
}

TriangleMesh box(const Vec3& lower, const Vec3& upper, uint32_t divisions) {
    const Vec3 size = upper - lower, x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
    TriangleMesh mesh = quad(lower, y, x, divisions);
    append(mesh, quad(lower, z, y, divisions));
    append(mesh, quad(lower, x, z, divisions));
    append(mesh, quad(upper, -x, -y, divisions));
    append(mesh, quad(upper, -y, -z, divisions));
    append(mesh, quad(upper, -z, -x, divisions));
    return mesh;
}

TriangleMesh icosphere(double radius, uint32_t subdivisions, bool smooth) {
    const double g = (1 + std::sqrt(5.0)) / 2;
    std::vector<Vec3> vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                  {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    for (Vec3& v : vertices) v = normalized(v);
    std::vector<Triangle> triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                                       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (uint32_t i = 0; i < subdivisions; i++) subdivide(vertices, triangles);
    TriangleMesh mesh;
    mesh.triangles = std::move(triangles);
    for (const Vec3& v : vertices) {
        mesh.positions.push_back((radius * v).to_float());
        if (smooth) mesh.normals.push_back(v.to_float());
    }
    return mesh;
}

TriangleMesh torus(double radius, double tube, uint32_t columns, uint32_t rows, bool smooth) {
    const auto normal = [](double s, double t) {
        return Vec3(std::cos(2 * pi * t) * std::cos(2 * pi * s), std::cos(2 * pi * t) * std::sin(2 * pi * s), std::sin(2 * pi * t));
    };
    // The last column and row take the parameter of the first, so that the seam is closed.
    const auto wrap = [](double s) { return s == 1 ? 0 : s; };
    const auto point = [&](double s, double t) {
        const Vec3 ring(std::cos(2 * pi * wrap(s)), std::sin(2 * pi * wrap(s)), 0);
        return radius * ring + tube * normal(wrap(s), wrap(t));
    };
    TriangleMesh mesh = patch(columns, rows, point);
    if (smooth) mesh.normals = patch(columns, rows, normal).positions;
    return mesh;
}

TriangleMesh fan(const Vec3& center, double radius, uint32_t triangles) {
    TriangleMesh mesh;
    mesh.positions.push_back(center.to_float());
    for (uint32_t i = 0; i < triangles; i++) {
        const double angle = 2 * pi * i / triangles;
        mesh.positions.push_back((center + radius * Vec3(std::cos(angle), std::sin(angle), 0)).to_float());
        mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % triangles});
    }
    return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
    RAYPAGER_CHECK(mesh.normals.empty() == other.normals.empty() || mesh.positions.empty());
    const auto base = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    mesh.normals.insert(mesh.normals.end(), other.normals.begin(), other.normals.end());
    for (Triangle t : other.triangles) {
        for (uint32_t& index : t) index += base;
        mesh.triangles.push_back(t);
    }
}

void add_normals(TriangleMesh& mesh) {
    std::vector<Vec3> sums(mesh.positions.size());
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
        for (const uint32_t vertex : t) sums[vertex] += cross(b - a, c - a);
    }
    mesh.normals.clear();
    for (const Vec3& sum : sums) mesh.normals.push_back(is_black(sum) ? Float3{} : normalized(sum).to_float());
}

}  // namespace raypager::reference
