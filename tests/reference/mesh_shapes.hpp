// Meshes for test scenes.
#pragma once

#include <functional>

#include "raypager/scene.hpp"
#include "reference/vector.hpp"

namespace raypager::reference {

// (columns + 1) x (rows + 1) vertices; point(s, t) for s, t in [0, 1]. Its outside is that of cross(d point / ds, d point / dt).
TriangleMesh patch(uint32_t columns, uint32_t rows, const std::function<Vec3(double s, double t)>& point);
TriangleMesh quad(const Vec3& corner, const Vec3& edge_s, const Vec3& edge_t, uint32_t divisions = 1);
TriangleMesh box(const Vec3& lower, const Vec3& upper, uint32_t divisions = 1);  // closed; faces do not share vertices
// 20 * 4^subdivisions triangles, closed, about the origin. smooth: with normals.
TriangleMesh icosphere(double radius, uint32_t subdivisions, bool smooth = false);
// Closed, about the z axis, with a seam of doubled vertices at the same places.
TriangleMesh torus(double radius, double tube, uint32_t columns, uint32_t rows, bool smooth = false);
// Triangles around one vertex in the plane z = height(s): corners (cos, sin) of a regular polygon.
TriangleMesh fan(const Vec3& center, double radius, uint32_t triangles);

void append(TriangleMesh& mesh, const TriangleMesh& other);  // REQUIRES: both have normals, or none
// Area-weighted vertex normals.
void add_normals(TriangleMesh& mesh);

}  // namespace raypager::reference
