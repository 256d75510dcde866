// Costs of the surface area heuristic (SAH), relative to a step through an inner node of a block.
#pragma once

namespace raypager {

inline constexpr float node_cost = 1.0f;
inline constexpr float leaf_cost = 0.5f;
// A triangle in a strip costs less than a node: it shares loads and the shearing of vertices with its neighbours.
inline constexpr float primitive_cost = 0.5f;

// When triangles are grouped into strips, in areas of the mean triangle: what another leaf costs in bytes (node, leaf record, ids: 56),
// and a triangle that is left without neighbours and so will need a leaf of its own. With 12 and 12, closed meshes have 3.7 to 3.8
// triangles a leaf and take 21 to 22 bytes a triangle; 4 and 4 would save 2 % of the traversal cost for 2 bytes more.
inline constexpr float leaf_overhead = 12.0f;
inline constexpr float stranded_cost = 12.0f;

}  // namespace raypager
