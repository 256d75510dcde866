#include "wide/top.hpp"

#include <bit>
#include <cmath>
#include <limits>

#include "base/check.hpp"
#include "wide/tree_writer.hpp"

namespace raypager {
namespace {

// Entering a portal, relative to a wide node.
constexpr float portal_cost = 1.0f;

// The grid's box, rounded outwards to floats.
Box world_box(const rp_top_grid& grid, const rp_child& child) {
    Box box;
    const rp_u32 words[3] = {child.x, child.y, child.z};
    const auto place = [&](int axis, rp_u32 q) {
        return double(grid.origin[axis]) + double(grid.cell[axis]) * double(std::bit_cast<float>(0x47000000u | q << 8));
    };
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
    if (ref >= RP_REF_PORTAL) {
        out[index].item = ref & ~RP_REF_PORTAL;
        out[index].leaf_cost = portal_cost;
        return index;
    }
    uint32_t children[2];
    for (int side = 0; side < 2; side++) {
        const rp_child& child = nodes[ref].child[side];
        children[side] = add(grid, nodes, child.ref, world_box(grid, child), out);
    }
    out[index].left = children[0];
    out[index].right = children[1];
    return index;
}

}  // namespace

std::vector<std::byte> make_wide_top(const rp_top_grid& grid, std::span<const rp_node> nodes, std::span<const rp_portal> portals,
                                     std::span<const rp_u32> wide_roots) {
    std::vector<BinaryNode> binary;
    if (!portals.empty()) {
        // The root's own box is never tested.
        Box unit;
        unit.grow(Float3{0, 0, 0});
        unit.grow(Float3{1, 1, 1});
        add(grid, nodes, grid.root, unit, binary);
    }
    Collapse collapse;
    collapse.run(binary);
    std::vector<std::byte> bytes;
    WideTreeWriter writer(binary, collapse, bytes, [&](const BinaryNode& node, std::vector<std::byte>& out) {
        const rp_wide_leaf head = {RP_WIDE_PORTAL, 0, 0, 0, portals[node.item].block};
        const rp_u32 words[2] = {wide_roots[node.item], 0};
        const auto append = [&out](const void* data, size_t count) {
            const auto* begin = static_cast<const std::byte*>(data);
            out.insert(out.end(), begin, begin + count);
        };
        append(&head, sizeof head);
        append(words, sizeof words);
    });
    writer.finish(RP_NONE, binary.empty() ? RP_NONE : writer.add_root(0));
    return bytes;
}

}  // namespace raypager
