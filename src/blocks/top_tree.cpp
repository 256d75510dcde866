#include "blocks/top_tree.hpp"

#include "base/check.hpp"
#include "blocks/grid.hpp"
#include "blocks/split_tree.hpp"

namespace raypager {
namespace {

class Builder {
public:
    explicit Builder(std::span<const Box> boxes) {
        for (size_t i = 0; i < boxes.size(); i++) refs_.push_back({boxes[i], static_cast<uint32_t>(i), 1});
        splits_ = build_split_tree(refs_, RP_TOP_MAX_DEPTH);
        grid_ = make_grid(splits_[0].box);
        tree_.paths.resize(boxes.size());
        tree_.grid.root = add(0, 1);
        tree_.grid.portal_count = static_cast<rp_u32>(boxes.size());
        std::copy_n(grid_.origin, 3, tree_.grid.origin);
        std::copy_n(grid_.cell, 3, tree_.grid.cell);
    }

    TopTree take() { return std::move(tree_); }

private:
    rp_u32 add(uint32_t split, uint64_t path) {
        const SplitNode& node = splits_[split];
        if (node.is_leaf()) {
            const uint32_t portal = refs_[node.first].id;
            tree_.paths[portal] = path;
            return RP_REF_PORTAL | portal;
        }
        const auto place = static_cast<rp_u32>(tree_.nodes.size());
        tree_.nodes.emplace_back();
        const uint32_t children[2] = {node.left, node.right};
        for (uint32_t side = 0; side < 2; side++) {
            const rp_u32 ref = add(children[side], path << 1 | side);
            tree_.nodes[place].child[side] = quantise(grid_, splits_[children[side]].box, ref);
        }
        return place;
    }

    std::vector<PrimitiveRef> refs_;
    std::vector<SplitNode> splits_;
    Grid grid_;
    TopTree tree_;
};

}  // namespace

TopTree build_top_tree(std::span<const Box> boxes) {
    RAYPAGER_CHECK(boxes.size() < 0x3ffffffe);  // portal indices have 30 bits, and the two last references mean something else
    if (!boxes.empty()) return Builder(boxes).take();
    TopTree empty;
    empty.grid.root = RP_REF_EXIT;
    std::fill_n(empty.grid.cell, 3, 1.0f);
    return empty;
}

}  // namespace raypager
