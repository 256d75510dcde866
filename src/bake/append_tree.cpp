#include "bake/append_tree.hpp"

#include "base/check.hpp"

namespace raypager {

rp_top_grid append_tree(const TopTree& tree, uint64_t first_block_entry, BakedScene& baked) {
    const auto first_node = static_cast<rp_u32>(baked.top_nodes.size());
    RAYPAGER_CHECK(baked.top_nodes.size() + tree.nodes.size() < RP_REF_LEAF);
    RAYPAGER_CHECK(first_block_entry + tree.grid.block_entry_count <= (RP_REF_END & ~RP_REF_BLOCK_ENTRY));
    const auto moved = [&](rp_u32 ref) {
        if (ref == RP_REF_EXIT) return ref;
        return ref + ((ref & RP_REF_BLOCK_ENTRY) == RP_REF_BLOCK_ENTRY ? static_cast<rp_u32>(first_block_entry) : first_node);
    };
    for (rp_node node : tree.nodes) {
        for (rp_child& child : node.child) child.ref = moved(child.ref);
        baked.top_nodes.push_back(node);
    }
    rp_top_grid grid = tree.grid;
    grid.root = moved(grid.root);
    return grid;
}

}  // namespace raypager
