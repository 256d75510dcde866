// Which wide tree a binary tree of small leaves becomes: what nodes and leaves it will have, before any of it is written.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/check.hpp"
#include "block/wide_collapse.hpp"
#include "block/wide_leaf_content.hpp"
#include "raypager/abi/wide.h"

namespace raypager {

// Tree is a class with
//   bool is_leaf(uint32_t ref) const;
//   std::array<uint32_t, 2> children(uint32_t ref) const;  of an inner node
//   Box bounds(uint32_t ref) const;                        of a leaf
//   LeafContent content(uint32_t ref) const;               of a leaf
// and Record one with
//   void clear();
//   bool add(const Tree&, uint32_t ref);  a leaf of it; false if it does not go into the record, which then is of no use
template <class Tree, class Record>
class WidePlan {
public:
    // Room for a tree of so many nodes.
    void reserve(size_t nodes) {
        nodes_.reserve(nodes);
        contents_.reserve(nodes);
    }
    void make(const Tree& tree, std::span<const uint32_t> roots) {
        nodes_.clear();
        contents_.clear();
        roots_.clear();
        for (const uint32_t root : roots) roots_.push_back(add(tree, root));
        collapse_.run(nodes_);
    }

    std::span<const BinaryNode> nodes() const { return nodes_; }
    const Collapse& collapse() const { return collapse_; }
    // The roots among the nodes, in the order in which they were given.
    std::span<const uint32_t> roots() const { return roots_; }

    // All leaves beneath a node that became one leaf of the wide tree.
    const Record& gathered(const Tree& tree, const BinaryNode& node) {
        record_.clear();
        RAYPAGER_CHECK(gather(tree, node));
        return record_;
    }

private:
    // Costs of testing a leaf, relative to a wide node (collapse.cpp).
    static constexpr float leaf_cost = 1.0f, triangle_cost = 0.05f, sphere_cost = 0.2f;  // one instance is a leaf

    // Adds the subtree, parents first; returns its place.
    uint32_t add(const Tree& tree, uint32_t ref) {
        const auto index = static_cast<uint32_t>(nodes_.size());
        nodes_.emplace_back();
        contents_.emplace_back();
        nodes_[index].item = ref;
        if (tree.is_leaf(ref)) {
            nodes_[index].box = tree.bounds(ref);
            contents_[index] = tree.content(ref);
        } else {
            const auto children = tree.children(ref);
            const uint32_t left = add(tree, children[0]), right = add(tree, children[1]);
            BinaryNode& node = nodes_[index];
            node.left = left;
            node.right = right;
            node.box = nodes_[left].box;
            node.box.grow(nodes_[right].box);
            contents_[index] = contents_[left];
            contents_[index].add(contents_[right]);
        }
        weigh_as_leaf(tree, index);
        return index;
    }

    // Adds the leaves of a subtree to the record; false if they do not fit into one.
    bool gather(const Tree& tree, const BinaryNode& node) {
        if (node.is_leaf()) return record_.add(tree, node.item);
        return gather(tree, nodes_[node.left]) && gather(tree, nodes_[node.right]);
    }

    void weigh_as_leaf(const Tree& tree, uint32_t index) {
        const LeafContent& content = contents_[index];
        const int kinds = (content.triangles > 0) + (content.spheres > 0) + (content.points > 0);
        if (kinds > 1 || content.instances > 1 || content.triangles > RP_WIDE_LEAF_TRIANGLES ||
            content.spheres + content.points > RP_WIDE_LEAF_SPHERES)
            return;
        if (content.vertices > RP_WIDE_LEAF_VERTICES) {
            record_.clear();
            if (!gather(tree, nodes_[index])) return;
        }
        nodes_[index].leaf_cost =
            leaf_cost + triangle_cost * static_cast<float>(content.triangles) + sphere_cost * static_cast<float>(content.spheres + content.points);
    }

    std::vector<BinaryNode> nodes_;
    std::vector<LeafContent> contents_;  // of each node's subtree
    std::vector<uint32_t> roots_;
    Collapse collapse_;
    Record record_;
};

}  // namespace raypager
