// What every source of meshes does before it hands a mesh over.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// Drops the triangles that no ray can hit, keeping the order of the others: those with an index out of range, a vertex that is not
// finite, the same vertex twice, or no area at all. Counts (and keeps) repeated triangles and edges of more than two triangles.
// Normals that are not finite become zero, which stands for "none here"; normals that do not match the positions in number are dropped.
// Linear in time and memory (about 12 bytes a triangle and 8 a vertex, one pass after the other).
void clean_mesh(TriangleMesh& mesh, MeshIssues& issues);

}  // namespace raypager
