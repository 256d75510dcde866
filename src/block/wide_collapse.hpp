// From a binary tree to one with eight children a node: which inner nodes stay, and which subtrees become one leaf, at the least cost by
// the surface area heuristic. Dynamic programming as in Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through
// Compressed Wide BVHs", section 3.1.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "raypager/abi/wide.h"
#include "scene/box.hpp"

namespace raypager {

struct BinaryNode {
    static constexpr uint32_t none = ~uint32_t{0};
    Box box;
    uint32_t left = none, right = none;  // behind their parent; none: a leaf
    uint32_t item = 0;                   // for the caller
    // Of the subtree as one leaf, without its area; infinite: it cannot be one.
    float leaf_cost = std::numeric_limits<float>::infinity();
    bool is_leaf() const { return left == none; }
};

struct WideChild {
    uint32_t node;  // binary node that it stands for
    bool leaf;
};

class WideChildren {
public:
    void add(WideChild child) { children_[count_++] = child; }
    const WideChild* begin() const { return children_.data(); }
    const WideChild* end() const { return children_.data() + count_; }
    uint32_t count() const { return count_; }

private:
    std::array<WideChild, RP_WIDE_CHILDREN> children_;
    uint32_t count_ = 0;
};

class Collapse {
public:
    // Costs of all nodes; a forest is as good as a tree. The nodes stay as they are while this is in use. A binary leaf must have a leaf cost.
    void run(std::span<const BinaryNode> nodes);
    // Whether the subtree becomes one leaf where it is the child of a wide node, or a root.
    bool is_leaf(uint32_t node) const { return plans_[node].leaf; }
    // Children of the wide node that the subtree becomes; two at least. REQUIRES: not a binary leaf.
    WideChildren children(uint32_t node) const;

private:
    struct Plan {
        // cost[n - 1]: of the subtree as at most n children of a wide node; share[n - 1]: how many of these the left side gets, 0: fewer
        // than n are better.
        float cost[RP_WIDE_CHILDREN - 1];
        uint8_t share[RP_WIDE_CHILDREN - 1];
        uint8_t inner_share;  // the same for the eight children of the wide node that the subtree becomes
        bool leaf;
    };
    void plan(uint32_t node);
    void add_children(uint32_t node, uint32_t most, WideChildren& out) const;

    std::span<const BinaryNode> nodes_;
    std::vector<Plan> plans_;
};

}  // namespace raypager
