// The tree above all blocks, over their portals.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "blocks/box.hpp"
#include "raypager/abi/block.h"

namespace raypager {

struct TopTree {
    rp_top_grid grid = {};
    std::vector<rp_node> nodes;   // in depth-first order
    std::vector<uint64_t> paths;  // of the portals, see abi/block.h
};

// boxes: of the portals, in their order. No portals: an empty tree.
TopTree build_top_tree(std::span<const Box> boxes);

}  // namespace raypager
