// A block's stored form (abi/block.h) -> its form in the memory of a CPU (abi/wide.h), in linear time.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "block/wide_instances.hpp"
#include "block/wide_leaf.hpp"
#include "block/wide_plan.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/wide.h"

namespace raypager {

// Keeps its working memory from block to block. Not thread-safe.
class WideBlockMaker {
public:
    // stored: bytes that check_block accepts, aligned to 4. roots: child references of the block's block entries, in
    // order. The result lies in this object until the next call; its size is a multiple of RP_BLOCK_ALIGNMENT.
    std::span<const std::byte> make(std::span<const std::byte> stored, std::span<const rp_u32> roots);
    // Words of the roots in the block made last, in the same order.
    std::span<const rp_u32> roots() const { return roots_; }

private:
    struct Tree {
        const StoredBlock& block;
        bool is_leaf(rp_u32 ref) const { return ref & RP_REF_LEAF; }
        std::array<rp_u32, 2> children(rp_u32 ref) const { return {block.nodes[ref].child[0].ref, block.nodes[ref].child[1].ref}; }
        Box bounds(rp_u32 ref) const { return bounds_of_leaf(block, ref); }
        LeafContent content(rp_u32 ref) const { return content_of_leaf(ref); }
    };
    struct Record : WideLeaf {
        bool add(const Tree& tree, rp_u32 ref) { return WideLeaf::add(tree.block, ref); }
    };

    WidePlan<Tree, Record> plan_;
    WideInstancesMaker instances_;
    std::vector<std::byte> bytes_;
    std::vector<rp_u32> roots_;
};

}  // namespace raypager
