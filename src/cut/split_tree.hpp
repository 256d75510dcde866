// A binary tree over boxes by the surface area heuristic, of bounded depth: the trees inside blocks and the top tree.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "world/world.hpp"

namespace raypager {

// Node 0 is the root. The refs beneath a node are consecutive.
struct SplitNode {
    Box box;
    uint32_t first, count;         // refs
    uint32_t left = 0, right = 0;  // both 0: a leaf
    bool is_leaf() const { return left == 0; }
};

// Reorders refs and splits them down to leaves of at most leaf_size. Children come after their parents. Wherever a leaf ends up, going
// on from it to single refs is possible within max_depth inner nodes from the root (REQUIRES: 1 <= refs.size() <= 2^max_depth).
std::vector<SplitNode> build_split_tree(std::span<PrimitiveRef> refs, int max_depth, uint32_t leaf_size = 1);

}  // namespace raypager
