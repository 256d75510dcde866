#include "block/wide_top.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

#include "base/check.hpp"
#include "block/wide_node.hpp"
#include "block/wide_tree_writer.hpp"

namespace raypager {
namespace {

static_assert(sizeof(rp_wide_block_entry) == sizeof(rp_block_entry) && offsetof(rp_wide_block_entry, block) == offsetof(rp_block_entry, block));

// All that a grid can tell: the box of the root, which no node holds.
constexpr rp_child whole_grid = {0xffff0000u, 0xffff0000u, 0xffff0000u, 0};

// Entering a block entry, relative to a wide node.
constexpr float block_entry_cost = 1.0f;

// The grid's box, rounded outwards to floats.
Box world_box(const rp_top_grid& grid, const rp_child& child) {
    Box box;
    const rp_u32 words[3] = {child.x, child.y, child.z};
    const auto place = [&](int axis, rp_u32 q) { return double(grid.origin[axis]) + double(grid.cell[axis]) * RP_GRID_VALUE(q); };
    constexpr float inf = std::numeric_limits<float>::infinity();
    for (int a = 0; a < 3; a++) {
        box.lower[a] = std::nextafter(static_cast<float>(place(a, words[a] & 0xffffu)), -inf);
        box.upper[a] = std::nextafter(static_cast<float>(place(a, words[a] >> 16)), inf);
    }
    return box;
}

// Adds the subtree, parents first.
uint32_t add(const rp_top_grid& grid, std::span<const rp_node> nodes, rp_u32 ref, const Box& box, std::vector<BinaryNode>& out) {
    const auto index = static_cast<uint32_t>(out.size());
    out.emplace_back();
    out[index].box = box;
    if (ref >= RP_REF_BLOCK_ENTRY) {
        out[index].item = ref & ~RP_REF_BLOCK_ENTRY;
        out[index].leaf_cost = block_entry_cost;
        return index;
    }
    uint32_t children[2];
    for (int side = 0; side < 2; side++) {
        const rp_child& child = nodes[ref].child[side];
        children[side] = add(grid, nodes, child.ref, world_box(grid, child), out);
    }
    // What bakers write is nested already. The order in which streams wait depends on it, so it holds whatever a file says.
    for (const uint32_t child : children) out[index].box.grow(out[child].box);
    out[index].left = children[0];
    out[index].right = children[1];
    return index;
}

rp_wide_block_entry make_block_entry(const Box& tight, rp_u32 block, rp_u32 root) {
    const Box box = with_slack(tight);
    return {{box.lower[0], box.lower[1], box.lower[2]}, block, {box.upper[0], box.upper[1], box.upper[2]}, root};
}

}  // namespace

WideTop make_wide_top(const rp_top_grid& grid, std::span<const rp_object> objects, std::span<const rp_node> nodes,
                      std::span<const rp_block_entry> block_entries, std::span<const rp_u32> wide_roots) {
    WideTop top;
    std::vector<BinaryNode> binary;
    std::vector<uint32_t> trees;  // where each begins, the world's first
    const auto add_tree = [&](const rp_top_grid& of) {
        trees.push_back(block_entries.empty() || of.root == RP_REF_EXIT ? RP_NONE : add(of, nodes, of.root, world_box(of, whole_grid), binary));
    };
    add_tree(grid);
    for (const rp_object& object : objects) add_tree(object.top);
    top.block_entries.resize(block_entries.size());
    for (const BinaryNode& node : binary)
        if (node.is_leaf()) top.block_entries[node.item] = make_block_entry(node.box, block_entries[node.item].block, wide_roots[node.item]);
    Collapse collapse;
    collapse.run(binary);
    WideTreeWriter writer(binary, collapse, top.bytes, [&](const BinaryNode& node, std::vector<std::byte>& out) {
        const rp_wide_leaf head = {RP_WIDE_BLOCK_ENTRY, 0, 0, 0, block_entries[node.item].block};
        const rp_u32 words[2] = {wide_roots[node.item], node.item};
        const auto append = [&out](const void* data, size_t count) {
            const auto* begin = static_cast<const std::byte*>(data);
            out.insert(out.end(), begin, begin + count);
        };
        append(&head, sizeof head);
        append(words, sizeof words);
    });
    const auto root_of = [&](uint32_t tree) { return tree == RP_NONE ? RP_NONE : writer.add_root(tree); };
    const rp_u32 root = root_of(trees[0]);
    for (const uint32_t tree : std::span(trees).subspan(1)) top.object_roots.push_back(root_of(tree));
    writer.finish(RP_NONE, root);
    return top;
}

}  // namespace raypager
