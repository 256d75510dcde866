// Loop's subdivision surfaces (Loop 1987, "Smooth Subdivision Surfaces Based on Triangles"), as pbrt has them.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// Each level makes four triangles of one. Vertices of the result lie on the surface itself, the limit of all levels, and have its normals. Edges with
// a triangle on one side alone are the surface's border, which depends on them alone. Where more than two triangles meet at an edge, or several fans
// at a vertex, and at vertices that do not exist, nothing is smooth: those vertices stay where they are. Triangles with vertices that do not exist or
// are not finite, or with one twice, are left out. uvs: as many as positions, or none; they are interpolated linearly.
TriangleMesh subdivide_loop(const std::vector<Float3>& positions, const std::vector<Float2>& uvs, const std::vector<Triangle>& triangles,
                            uint32_t levels);

}  // namespace raypager
