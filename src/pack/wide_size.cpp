#include "pack/wide_size.hpp"

#include <algorithm>
#include <array>

#include "block/wide_leaf.hpp"
#include "block/wide_plan.hpp"
#include "block/wide_tree_writer.hpp"

namespace raypager {
namespace {

// The tree before it is packed, which has all that the plan asks for at hand. Vertices of the same bits are one here, so numbers tell them apart.
struct Tree {
    const Bvh& bvh;
    std::span<const rp_sphere> spheres;

    const Leaf& leaf(uint32_t node) const { return bvh.leaves[bvh.nodes[node].leaf]; }
    bool is_leaf(uint32_t node) const { return bvh.nodes[node].is_leaf(); }
    std::array<uint32_t, 2> children(uint32_t node) const { return {bvh.nodes[node].left, bvh.nodes[node].right}; }
    Box bounds(uint32_t node) const {
        const Leaf& at = leaf(node);
        return at.has_spheres() ? bounds_of_spheres(&spheres[at.first_sphere], at.flags) : bvh.nodes[node].box;
    }
    LeafContent content(uint32_t node) const { return content_of_leaf(leaf(node).flags); }
};

class Record {
public:
    void clear() { size_ = {}; }
    bool add(const Tree& tree, uint32_t node) {
        const Leaf& leaf = tree.leaf(node);
        if (!size_.add(leaf.flags)) return false;
        if (leaf.has_spheres()) return true;
        for (const uint32_t v : std::span(leaf.vertices).first(leaf.count() + 2)) {
            if (std::find(vertices_.begin(), vertices_.begin() + size_.vertices, v) != vertices_.begin() + size_.vertices) continue;
            if (size_.vertices == RP_WIDE_LEAF_VERTICES) return false;
            vertices_[size_.vertices++] = v;
            size_.has_normals |= tree.bvh.vertices[v].normal != RP_NONE;
            size_.has_colors |= tree.bvh.vertices[v].color != RP_NONE;
            size_.has_uvs |= tree.bvh.vertices[v].uv != Float2{};
        }
        return true;
    }
    uint32_t bytes() const { return size_.places().end; }

private:
    std::array<uint32_t, RP_WIDE_LEAF_VERTICES> vertices_;
    WideLeafSize size_;
};

}  // namespace

WideSize measure_wide_form(const Bvh& bvh, std::span<const rp_sphere> spheres) {
    const Tree tree = {bvh, spheres};
    WidePlan<Tree, Record> plan;
    plan.reserve(bvh.nodes.size());
    plan.make(tree, bvh.block_entries);
    ByteCount bytes;
    WideTreeWriter writer(plan.nodes(), plan.collapse(), bytes,
                          [&](const BinaryNode& node, ByteCount& count) { count.resize(count.size() + plan.gathered(tree, node).bytes()); });
    WideSize size;
    for (const uint32_t root : plan.roots()) size.roots.push_back(writer.add_root(root));
    writer.finish(RP_NONE, RP_NONE);
    size.bytes = static_cast<uint32_t>(bytes.size());
    return size;
}

}  // namespace raypager
