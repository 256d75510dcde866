// Blocks of instances -> their form for CPUs (abi/wide.h).
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "block/wide_leaf.hpp"
#include "block/wide_plan.hpp"
#include "raypager/abi/instance.h"

namespace raypager {

// As WideBlockMaker, for blocks that hold instances.
class WideInstancesMaker {
public:
    std::span<const std::byte> make(const StoredBlock& block, std::span<const std::byte> stored, rp_u32 root);
    rp_u32 root() const { return root_; }

private:
    // Boxes are those of the stored tree: instances have none of their own.
    struct Tree {
        const StoredBlock& block;
        std::span<const Box> boxes;  // of each instance
        static uint32_t index(rp_u32 ref) { return ref >> RP_LEAF_INDEX_SHIFT & RP_LEAF_INDEX_MASK; }
        bool is_leaf(rp_u32 ref) const { return ref & RP_REF_LEAF; }
        std::array<rp_u32, 2> children(rp_u32 ref) const { return {block.nodes[ref].child[0].ref, block.nodes[ref].child[1].ref}; }
        Box bounds(rp_u32 ref) const { return boxes[index(ref)]; }
        LeafContent content(rp_u32) const {
            LeafContent content;
            content.instances = 1;
            return content;
        }
    };
    struct Record {
        uint32_t index = RP_NONE;
        void clear() { index = RP_NONE; }
        bool add(const Tree& tree, rp_u32 ref) {
            if (index != RP_NONE) return false;
            index = tree.index(ref);
            return true;
        }
    };
    void find_boxes(const StoredBlock& block, rp_u32 root);

    WidePlan<Tree, Record> plan_;
    std::vector<Box> boxes_;
    std::vector<std::byte> bytes_;
    rp_u32 root_ = 0;
};

}  // namespace raypager
