// A block's stored form (abi/block.h) -> its form in the memory of a CPU (abi/wide.h), in linear time.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "raypager/abi/block.h"
#include "raypager/abi/wide.h"
#include "wide/collapse.hpp"
#include "wide/leaf.hpp"

namespace raypager {

// Keeps its working memory from block to block. Not thread-safe.
class WideBlockMaker {
public:
    // stored: bytes that check_block accepts, aligned to 4. roots: child references of the block's portals, in order.
    // The result lies in this object until the next call; its size is a multiple of RP_BLOCK_ALIGNMENT.
    std::span<const std::byte> make(std::span<const std::byte> stored, std::span<const rp_u32> roots);
    // Words of the roots in the block made last, in the same order.
    std::span<const rp_u32> roots() const { return roots_; }

private:
    uint32_t add(const StoredBlock& block, rp_u32 ref);
    bool gather(const StoredBlock& block, const BinaryNode& node);
    void weigh_as_leaf(const StoredBlock& block, uint32_t index);

    std::vector<BinaryNode> nodes_;
    std::vector<LeafContent> contents_;  // of each node's subtree
    std::vector<uint32_t> tops_;         // the roots among the nodes
    Collapse collapse_;
    WideLeaf leaf_;
    std::vector<std::byte> bytes_;
    std::vector<rp_u32> roots_;
};

}  // namespace raypager
