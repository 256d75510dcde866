// What every source of meshes does before it hands a mesh over.
#pragma once

#include <cmath>

#include "raypager/scene.hpp"

namespace raypager {

// Areas between coordinates up to here are finite in single precision.
inline constexpr float largest_uv = 0x1p60f;
// Coordinates of textures as blocks hold them: zeros where one is not finite, or too large; that is counted.
// -0 becomes 0, since zeros stand for none.
inline Float2 usable_uv(const Float2& uv, MeshIssues& issues) {
    if (std::abs(uv.x) <= largest_uv && std::abs(uv.y) <= largest_uv) return {uv.x + 0.0f, uv.y + 0.0f};
    issues.bad_uv++;
    return {};
}

// Drops the triangles that no ray can hit, keeping the order of the others: those with an index out of range, a vertex that is not
// finite, the same vertex twice, or no area at all. Counts (and keeps) repeated triangles and edges of more than two triangles.
// Normals that are not finite become zero, which stands for "none here"; normals that do not match the positions in number are dropped.
// So are colours and coordinates of textures; of the latter see usable_uv.
// Linear in time and memory (about 12 bytes a triangle and 8 a vertex, one pass after the other).
void clean_mesh(TriangleMesh& mesh, MeshIssues& issues);

}  // namespace raypager
