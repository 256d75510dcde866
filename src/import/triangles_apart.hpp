// Meshes whose triangles have coordinates of textures of their own, and so share no vertices.
#pragma once

#include "raypager/abi/types.h"
#include "raypager/scene.hpp"

namespace raypager {

// As pbrt has them at the corners of a triangle where a mesh has none.
inline constexpr Float2 uvs_of_bare_triangle[3] = {{0, 0}, {1, 0}, {1, 1}};

// uv(i, k): at corner k of triangle i. Corners that do not exist stay as they are, to be dropped as in other meshes.
template <class Uv>
TriangleMesh triangles_apart(const TriangleMesh& mesh, const Uv& uv) {
    TriangleMesh apart;
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
        Triangle& made = apart.triangles.emplace_back();
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t vertex = mesh.triangles[i][k];
            made[k] = vertex < mesh.positions.size() ? static_cast<uint32_t>(apart.positions.size()) : RP_NONE;
            if (made[k] == RP_NONE) continue;
            apart.positions.push_back(mesh.positions[vertex]);
            if (!mesh.normals.empty()) apart.normals.push_back(mesh.normals[vertex]);
            apart.uvs.push_back(uv(i, k));
        }
    }
    return apart;
}

}  // namespace raypager
