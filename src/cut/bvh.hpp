// The tree of one block, before it is packed into bytes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raypager/abi/block.h"
#include "world/vertex_table.hpp"
#include "world/world.hpp"

namespace raypager {

struct Leaf {
    uint32_t flags = 0;  // bits 0-6 of its reference
    // A strip:
    uint32_t ids[RP_LEAF_MAX_PRIMITIVES] = {RP_NONE, RP_NONE, RP_NONE, RP_NONE};
    uint32_t vertices[RP_LEAF_MAX_PRIMITIVES + 2] = {};  // of the block
    // Spheres: the first one in Bvh::sphere_ids.
    uint32_t first_sphere = 0;
    // An instance: ids[0].
    bool is_instance() const { return (flags & RP_LEAF_INSTANCE) == RP_LEAF_INSTANCE; }
    bool has_spheres() const { return (flags & RP_LEAF_INSTANCE) == RP_LEAF_SPHERES; }
    uint32_t count() const { return (flags & (has_spheres() ? RP_LEAF_MAX_SPHERES - 1 : RP_LEAF_MAX_PRIMITIVES - 1)) + 1; }
};

struct BvhNode {
    Box box;
    uint32_t primitives = 0;       // beneath
    uint32_t left = 0, right = 0;  // children; both 0 for a leaf
    uint32_t leaf = 0;
    bool is_leaf() const { return left == 0; }
};

struct Bvh {
    std::vector<BvhNode> nodes;  // the root first, children after parents
    std::vector<Leaf> leaves;
    std::vector<VertexBits> vertices;
    std::vector<uint32_t> sphere_ids;  // leaf by leaf
    // Nodes where rays enter, from left to right; every leaf is beneath exactly one.
    std::vector<uint32_t> block_entries;
    uint32_t triangles = 0;
    VertexAttributes attributes;  // that any vertex has
};

// Builds the tree over refs (which are reordered; not empty) with at most block_entries block entries.
Bvh build_bvh(const World& world, std::span<PrimitiveRef> refs, uint32_t block_entries);

}  // namespace raypager
