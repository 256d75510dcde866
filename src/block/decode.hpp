// A block's bytes -> its primitives, on the host: for tests, inspection and tools.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "raypager/abi/block.h"
#include "raypager/scene.hpp"

namespace raypager {

struct DecodedTriangle {
    uint32_t id;
    Float3 vertices[3];   // counter-clockwise seen from the side of the normal; which comes first is not kept
    uint32_t normals[3];  // octahedral; RP_NONE: none
    uint32_t colors[3];   // as in abi/block.h; RP_NONE: none
    Float2 uvs[3] = {};   // zeros: none
};

struct DecodedSphere {
    uint32_t id;
    Float3 center;
    float radius;
    uint32_t point_word = RP_NONE;  // of a point (abi/block.h); RP_NONE: a sphere
};

// Typed views of the sections of a block of primitives. REQUIRES: bytes that BlockSource::check_block accepts, aligned to 8; no instances.
struct BlockView {
    explicit BlockView(std::span<const std::byte> bytes);
    rp_block_header header;
    std::span<const rp_node> nodes;
    std::span<const rp_leaf> leaves;
    std::vector<Float3> vertices;  // decoded
    std::span<const rp_sphere> spheres;
    std::span<const rp_u32> sphere_ids;  // one a sphere
    std::vector<rp_u32> ids;             // RP_LEAF_MAX_PRIMITIVES a leaf, decoded; those that a leaf does not use may be anything
    std::span<const rp_u32> normals;     // one per vertex, or none
    std::span<const rp_u32> colors;      // likewise
    std::span<const Float2> uvs;         // likewise
};

struct DecodedLeaf {
    std::vector<DecodedTriangle> triangles;
    std::vector<DecodedSphere> spheres;
};

// Appends the primitives of a leaf, in the order of the leaf.
void decode_leaf(const BlockView& block, rp_u32 ref, DecodedLeaf& out);
// All primitives beneath a child reference, depth first.
DecodedLeaf decode_subtree(const BlockView& block, rp_u32 ref);

}  // namespace raypager
