// Writes a block's tree as the bytes of abi/block.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cut/bvh.hpp"

namespace raypager {

struct PackedBlockEntry {
    Box box;
    rp_u32 root;           // child reference inside the block
    rp_u32 wide_root = 0;  // the same in its wide form
    uint32_t depth = 0;    // nodes above it in the block
};

struct PackedBlock {
    std::vector<std::byte> bytes;  // a multiple of RP_BLOCK_ALIGNMENT
    std::vector<PackedBlockEntry> block_entries;
    Box bounds;
    uint32_t triangles = 0, spheres = 0, instances = 0;
    uint32_t wide_bytes = 0;  // in the form of abi/wide.h; of instances, which have none: its size as it is
};

// header.block_index is left 0. Fails (returns false) if the block would exceed limit bytes or the reach of 16-bit vertex offsets:
// then it must be cut in two.
// position_cell: of which all coordinates are multiples; 0: positions stay floats.
bool pack(const World& world, const Bvh& bvh, uint64_t limit, float position_cell, PackedBlock& block);

}  // namespace raypager
