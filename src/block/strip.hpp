// Triangle strips as abi/block.h defines them for leaves.
#pragma once

#include <cstdint>
#include <span>

#include "block/visit_strip.hpp"
#include "raypager/abi/block.h"
#include "raypager/scene.hpp"

namespace raypager {

struct Strip {
    uint32_t count = 0;                                  // triangles
    uint32_t order[RP_LEAF_MAX_PRIMITIVES] = {};         // of the triangles in the input
    uint32_t vertices[RP_LEAF_MAX_PRIMITIVES + 2] = {};  // count + 2 of them
    uint32_t flags = 0;                                  // bits 0-5 of a leaf's reference: count, switches, winding
};

// The strip of 1 to 4 of the given triangles (vertex numbers in their true orientation), in this order. REQUIRES: each but the first
// shares an edge with the one before, which runs through it in the opposite direction, and not the edge that one shares with its
// own predecessor.
Strip make_strip(std::span<const Triangle> triangles, std::span<const uint32_t> order);

}  // namespace raypager
