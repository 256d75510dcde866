#include "block/wide_instances.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include "block/grid.hpp"
#include "block/wide_tree_writer.hpp"

namespace raypager {
namespace {

Box box_of_child(const Grid& grid, const rp_child& child) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    const rp_u32 words[3] = {child.x, child.y, child.z};
    Box box;
    for (int axis = 0; axis < 3; axis++) {
        const Interval interval = decode_interval(grid, axis, words[axis]);
        box.lower[axis] = std::nextafter(static_cast<float>(interval.lower), -inf);
        box.upper[axis] = std::nextafter(static_cast<float>(interval.upper), inf);
    }
    return box;
}

}  // namespace

void WideInstancesMaker::find_boxes(const StoredBlock& block, rp_u32 root) {
    const rp_block_header& header = block.header;
    boxes_.assign(header.leaf_count, Box());
    if (root & RP_REF_LEAF) {
        for (int axis = 0; axis < 3; axis++) boxes_[0].lower[axis] = header.lower[axis], boxes_[0].upper[axis] = header.upper[axis];
        return;
    }
    Grid grid;
    for (int axis = 0; axis < 3; axis++) grid.origin[axis] = header.origin[axis], grid.cell[axis] = header.cell[axis];
    for (uint32_t i = 0; i < header.node_count; i++)
        for (const rp_child& child : block.nodes[i].child)
            if (child.ref & RP_REF_LEAF) boxes_[Tree::index(child.ref)] = box_of_child(grid, child);
}

std::span<const std::byte> WideInstancesMaker::make(const StoredBlock& block, std::span<const std::byte> stored, rp_u32 root) {
    find_boxes(block, root);
    const Tree tree = {block, boxes_};
    plan_.make(tree, std::span(&root, 1));
    const std::byte* const records = stored.data() + block.header.leaves_at;
    const std::byte* const numbers = records + size_t{block.header.leaf_count} * sizeof(rp_instance);
    WideTreeWriter writer(plan_.nodes(), plan_.collapse(), bytes_, [&](const BinaryNode& node, std::vector<std::byte>& bytes) {
        const uint32_t index = plan_.gathered(tree, node).index;
        const rp_wide_leaf head = {RP_WIDE_INSTANCE, 0, 0, 0, block.header.block_index};
        const rp_u32 nothing = 0;
        const auto append = [&bytes](const void* data, size_t count) {
            const auto* begin = static_cast<const std::byte*>(data);
            bytes.insert(bytes.end(), begin, begin + count);
        };
        append(&head, sizeof head);
        append(numbers + size_t{index} * sizeof(rp_u32), sizeof(rp_u32));
        append(&nothing, sizeof nothing);
        append(records + size_t{index} * sizeof(rp_instance), sizeof(rp_instance));
    });
    root_ = writer.add_root(plan_.roots()[0]);
    writer.finish(block.header.block_index, RP_NONE);
    return bytes_;
}

}  // namespace raypager
