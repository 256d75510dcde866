// The tree above all blocks, over their block entries.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raypager/abi/block.h"
#include "scene/box4.hpp"

namespace raypager {

struct TopTree {
    rp_top_grid grid = {};
    std::vector<rp_node> nodes;   // in depth-first order
    std::vector<uint64_t> paths;  // of the block entries, see abi/block.h
};

struct BlockEntryBox {
    Box box;
    uint32_t depth;  // nodes above it in its block, at most RP_UPPER_TREE_MAX_DEPTH
};

// Block entries in their order: block by block, as their depths tell, and in each block from left to right. The tree is one over blocks, and in each
// of these as the block's own is above its block entries: a subtree, which a ray can do without where the block is resident. No block entries: an
// empty tree.
TopTree build_top_tree(std::span<const BlockEntryBox> block_entries);

}  // namespace raypager
