// The top tree (abi/block.h) -> its form for CPUs (abi/wide.h).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "raypager/abi/block.h"
#include "raypager/abi/instance.h"
#include "raypager/abi/wide.h"

namespace raypager {

struct WideTop {
    std::vector<std::byte> bytes;                    // the tree
    std::vector<rp_wide_block_entry> block_entries;  // as many as there were, in their order
    std::vector<rp_u32> object_roots;                // of their trees, words; RP_NONE: the object has nothing in it
};
// REQUIRES: a top tree as BlockFile::open accepts it. wide_roots: of the block entries in the wide form of their blocks.
WideTop make_wide_top(const rp_top_grid& grid, std::span<const rp_object> objects, std::span<const rp_node> nodes,
                      std::span<const rp_block_entry> block_entries, std::span<const rp_u32> wide_roots);

}  // namespace raypager
