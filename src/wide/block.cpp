#include "wide/block.hpp"

#include "wide/tree_writer.hpp"

namespace raypager {
namespace {

// Costs of testing a leaf, relative to a wide node (collapse.cpp).
constexpr float leaf_cost = 1.0f, triangle_cost = 0.05f, sphere_cost = 0.2f;

}  // namespace

// Adds the subtree, parents first; returns its place.
uint32_t WideBlockMaker::add(const StoredBlock& block, rp_u32 ref) {
    const auto index = static_cast<uint32_t>(nodes_.size());
    nodes_.emplace_back();
    contents_.emplace_back();
    nodes_[index].item = ref;
    if (ref & RP_REF_LEAF) {
        nodes_[index].box = bounds_of_leaf(block, ref);
        contents_[index] = content_of_leaf(ref);
    } else {
        const uint32_t left = add(block, block.nodes[ref].child[0].ref), right = add(block, block.nodes[ref].child[1].ref);
        BinaryNode& node = nodes_[index];
        node.left = left;
        node.right = right;
        node.box = nodes_[left].box;
        node.box.grow(nodes_[right].box);
        contents_[index] = contents_[left];
        contents_[index].add(contents_[right]);
    }
    weigh_as_leaf(block, index);
    return index;
}

// Adds the leaves of a subtree to leaf_; false if they do not fit into one record.
bool WideBlockMaker::gather(const StoredBlock& block, const BinaryNode& node) {
    if (node.is_leaf()) return leaf_.add(block, node.item);
    return gather(block, nodes_[node.left]) && gather(block, nodes_[node.right]);
}

void WideBlockMaker::weigh_as_leaf(const StoredBlock& block, uint32_t index) {
    const LeafContent& content = contents_[index];
    const int kinds = (content.triangles > 0) + (content.spheres > 0) + (content.points > 0);
    if (kinds > 1 || content.triangles > RP_WIDE_LEAF_TRIANGLES || content.spheres + content.points > RP_WIDE_LEAF_SPHERES) return;
    if (content.vertices > RP_WIDE_LEAF_VERTICES) {
        leaf_.clear();
        if (!gather(block, nodes_[index])) return;
    }
    nodes_[index].leaf_cost =
        leaf_cost + triangle_cost * static_cast<float>(content.triangles) + sphere_cost * static_cast<float>(content.spheres + content.points);
}

std::span<const std::byte> WideBlockMaker::make(std::span<const std::byte> stored, std::span<const rp_u32> roots) {
    const StoredBlock block(stored);
    nodes_.clear();
    contents_.clear();
    tops_.clear();
    for (const rp_u32 root : roots) tops_.push_back(add(block, root));
    collapse_.run(nodes_);
    WideTreeWriter writer(nodes_, collapse_, bytes_, [&](const BinaryNode& node, std::vector<std::byte>& bytes) {
        leaf_.clear();
        RAYPAGER_CHECK(gather(block, node));
        leaf_.append_to(bytes, block.header.block_index);
    });
    roots_.clear();
    for (const uint32_t top : tops_) roots_.push_back(writer.add_root(top));
    writer.finish(block.header.block_index, RP_NONE);
    return bytes_;
}

}  // namespace raypager
