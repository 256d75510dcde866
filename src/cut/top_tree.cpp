#include "cut/top_tree.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "block/grid.hpp"
#include "cut/split_tree.hpp"

namespace raypager {
namespace {

class TopTreeBuilder {
public:
    explicit TopTreeBuilder(std::span<const BlockEntryBox> block_entries) : block_entries_(block_entries) {
        std::vector<PrimitiveRef> refs;
        while (read_ < block_entries.size()) {
            const uint32_t upper = read_upper_tree(0);
            refs.push_back({upper_nodes_[upper].box, upper, 1});
        }
        const std::vector<SplitNode> splits = build_split_tree(refs, RP_TOP_MAX_DEPTH - static_cast<int>(deepest_));
        grid_ = make_grid(splits[0].box);
        tree_.paths.resize(block_entries.size());
        tree_.grid.root = add(splits, refs, 0, 1);
        tree_.grid.block_entry_count = static_cast<rp_u32>(block_entries.size());
        std::copy_n(grid_.origin, 3, tree_.grid.origin);
        std::copy_n(grid_.cell, 3, tree_.grid.cell);
    }

    TopTree take() { return std::move(tree_); }

private:
    struct UpperNode {
        Box box;
        uint32_t block_entry = 0;
        uint32_t left = 0, right = 0;  // both 0: the block entry
    };

    // The subtree that begins with the next block entry.
    uint32_t read_upper_tree(uint32_t depth) {
        RAYPAGER_CHECK(read_ < block_entries_.size() && depth <= block_entries_[read_].depth);
        const auto index = static_cast<uint32_t>(upper_nodes_.size());
        upper_nodes_.push_back({block_entries_[read_].box, static_cast<uint32_t>(read_)});
        deepest_ = std::max(deepest_, depth);
        if (block_entries_[read_].depth == depth) {
            read_++;
            return index;
        }
        const uint32_t left = read_upper_tree(depth + 1), right = read_upper_tree(depth + 1);
        UpperNode& upper = upper_nodes_[index];
        upper.left = left;
        upper.right = right;
        upper.box = upper_nodes_[left].box;
        upper.box.grow(upper_nodes_[right].box);
        return index;
    }

    rp_u32 add(const std::vector<SplitNode>& splits, const std::vector<PrimitiveRef>& refs, uint32_t split, uint64_t path) {
        const SplitNode& node = splits[split];
        if (node.is_leaf()) return add_upper_tree(refs[node.first].id, path);
        const rp_u32 place = add_node();
        const uint32_t children[2] = {node.left, node.right};
        for (uint32_t side = 0; side < 2; side++) {
            const rp_u32 ref = add(splits, refs, children[side], path << 1 | side);
            tree_.nodes[place].child[side] = quantise(grid_, splits[children[side]].box, ref);
        }
        return place;
    }

    rp_u32 add_upper_tree(uint32_t index, uint64_t path) {
        const UpperNode& upper = upper_nodes_[index];
        if (upper.left == 0) {
            tree_.paths[upper.block_entry] = path;
            return RP_REF_BLOCK_ENTRY | upper.block_entry;
        }
        const rp_u32 place = add_node();
        const uint32_t children[2] = {upper.left, upper.right};
        for (uint32_t side = 0; side < 2; side++) {
            const rp_u32 ref = add_upper_tree(children[side], path << 1 | side);
            tree_.nodes[place].child[side] = quantise(grid_, upper_nodes_[children[side]].box, ref);
        }
        return place;
    }

    rp_u32 add_node() {
        tree_.nodes.emplace_back();
        return static_cast<rp_u32>(tree_.nodes.size() - 1);
    }

    const std::span<const BlockEntryBox> block_entries_;
    size_t read_ = 0;
    uint32_t deepest_ = 0;
    std::vector<UpperNode> upper_nodes_;
    Grid grid_;
    TopTree tree_;
};

}  // namespace

TopTree build_top_tree(std::span<const BlockEntryBox> block_entries) {
    RAYPAGER_CHECK(block_entries.size() < 0x3ffffffe);  // block entry indices have 30 bits, and the last references mean something else
    if (!block_entries.empty()) return TopTreeBuilder(block_entries).take();
    TopTree empty;
    empty.grid.root = RP_REF_EXIT;
    std::fill_n(empty.grid.cell, 3, 1.0f);
    return empty;
}

}  // namespace raypager
