// A tree over some of the block entries -> those of a baked scene.
#pragma once

#include "block/baked_scene.hpp"
#include "cut/top_tree.hpp"

namespace raypager {

// Appends the tree's nodes. What it calls block entry 0 is first_block_entry of the scene. Returns its grid, as the scene has it; paths are left
// alone, since they are counted from the tree's own root.
rp_top_grid append_tree(const TopTree& tree, uint64_t first_block_entry, BakedScene& baked);

}  // namespace raypager
