#include "cut/bvh.hpp"

#include <algorithm>
#include <array>
#include <queue>
#include <tuple>

#include "base/check.hpp"
#include "cut/binning.hpp"
#include "cut/split_tree.hpp"
#include "cut/strip_cover.hpp"

namespace raypager {
namespace {

// A full leaf of spheres. With 4 they take 27.8 bytes each, all in, with 8 23.8, with 16 21.8; a CPU traces them all at the same speed.
constexpr uint32_t spheres_a_leaf = 8;
static_assert(spheres_a_leaf <= RP_LEAF_MAX_SPHERES);

// The tree is split down to treelets of up to most_covered primitives. These are grouped into leaves: triangles into strips, without
// regard to how a tree would split them, so that leaves get full; then the treelet's own tree is built over its leaves.
class BvhBuilder {
public:
    BvhBuilder(const World& world, std::span<PrimitiveRef> refs) : world_(world), refs_(refs), table_(refs.size()) {
        // With four triangles a leaf.
        bvh_.nodes.reserve(refs.size() / 2);
        bvh_.leaves.reserve(refs.size() / 4);
        treelets_ = build_split_tree(refs, RP_BLOCK_MAX_DEPTH, most_covered);
        add_node(0, 0);
        bvh_.vertices = table_.take();
        for (const VertexBits& vertex : bvh_.vertices) {
            bvh_.attributes.normals |= vertex.normal != RP_NONE;
            bvh_.attributes.colors |= vertex.color != RP_NONE;
            bvh_.attributes.uvs |= vertex.uv != Float2{};
        }
    }

    Bvh take() { return std::move(bvh_); }

private:
    uint32_t add_node(uint32_t split, int depth) {
        const SplitNode& node = treelets_[split];
        if (node.is_leaf()) return add_treelet(refs_.subspan(node.first, node.count), depth);
        const auto index = static_cast<uint32_t>(bvh_.nodes.size());
        bvh_.nodes.push_back({node.box, node.count});
        const uint32_t left = add_node(node.left, depth + 1), right = add_node(node.right, depth + 1);
        bvh_.nodes[index].left = left;
        bvh_.nodes[index].right = right;
        return index;
    }

    uint32_t add_treelet(std::span<PrimitiveRef> refs, int depth) {
        leaves_.clear();
        treelet_spheres_.clear();
        leaf_refs_.clear();
        if (world_.instances.empty())
            group_primitives(refs);
        else
            for (const PrimitiveRef& ref : refs) add_instance(ref);
        splits_ = build_split_tree(leaf_refs_, RP_BLOCK_MAX_DEPTH - depth);
        return add_split(0);
    }

    // An instance is a leaf for itself: a ray that meets its box walks a tree in another space, so boxes are as tight as they can be.
    void add_instance(const PrimitiveRef& ref) {
        Leaf leaf;
        leaf.flags = RP_LEAF_INSTANCE;
        leaf.ids[0] = ref.id;
        add_leaf(leaf, ref.box);
    }

    void group_primitives(std::span<PrimitiveRef> refs) {
        const auto is = [&](PrimitiveKind kind) { return [this, kind](const PrimitiveRef& ref) { return world_.kind(ref.id) == kind; }; };
        const auto spheres = std::partition(refs.begin(), refs.end(), is(PrimitiveKind::triangle));
        const auto points = std::partition(spheres, refs.end(), is(PrimitiveKind::sphere));
        if (spheres != refs.begin()) group_triangles(std::span(refs.begin(), spheres));
        if (points != spheres) group_spheres(std::span(spheres, points), RP_LEAF_SPHERES);
        if (refs.end() != points) group_spheres(std::span(points, refs.end()), RP_LEAF_SPHERES | RP_LEAF_POINTS);
    }

    void group_triangles(std::span<const PrimitiveRef> refs) {
        std::array<Triangle, most_covered> triangles;
        std::array<Box4, most_covered> boxes;
        // They lie anywhere in the world's arrays. Asked for one after the other, with nothing done in between, memory brings many at a time.
        for (size_t i = 0; i < refs.size(); i++) {
            triangles[i] = world_.primitives[refs[i].id];
            boxes[i] = refs[i].box4();
        }
        std::array<VertexBits, 3 * most_covered> vertices;
        for (size_t i = 0; i < refs.size(); i++)
            for (size_t k = 0; k < 3; k++) vertices[3 * i + k] = world_.vertex(triangles[i][k]);
        for (size_t i = 0; i < refs.size(); i++)
            for (size_t k = 0; k < 3; k++) triangles[i][k] = table_.number(vertices[3 * i + k]);
        for (const Strip& strip : cover_with_strips(std::span(triangles).first(refs.size()), std::span(boxes).first(refs.size()))) {
            Leaf leaf;
            Box box;
            leaf.flags = strip.flags;
            std::copy(std::begin(strip.vertices), std::end(strip.vertices), leaf.vertices);
            for (uint32_t i = 0; i < strip.count; i++) {
                leaf.ids[i] = refs[strip.order[i]].id;
                box.grow(refs[strip.order[i]].box);
            }
            add_leaf(leaf, box);
        }
        bvh_.triangles += static_cast<uint32_t>(refs.size());
    }

    // Splits at multiples of a full leaf, so that leaves get full.
    void group_spheres(std::span<PrimitiveRef> refs, uint32_t flags) {
        if (refs.size() > spheres_a_leaf) {
            const size_t middle = split_by_sweep(refs, spheres_a_leaf);
            group_spheres(refs.first(middle), flags);
            group_spheres(refs.subspan(middle), flags);
            return;
        }
        Leaf leaf;
        Box box;
        leaf.flags = static_cast<uint32_t>(refs.size() - 1) | flags;
        leaf.first_sphere = static_cast<uint32_t>(treelet_spheres_.size());
        for (const PrimitiveRef& ref : refs) {
            treelet_spheres_.push_back(ref.id);
            box.grow(ref.box);
        }
        add_leaf(leaf, box);
    }

    void add_leaf(const Leaf& leaf, const Box& box) {
        leaf_refs_.push_back({box, static_cast<uint32_t>(leaves_.size()), leaf.count()});
        leaves_.push_back(leaf);
    }

    uint32_t add_split(uint32_t split) {
        const SplitNode& node = splits_[split];
        const auto index = static_cast<uint32_t>(bvh_.nodes.size());
        bvh_.nodes.push_back({node.box});
        if (node.is_leaf()) {
            Leaf leaf = leaves_[leaf_refs_[node.first].id];
            if (leaf.has_spheres()) leaf.first_sphere = take_spheres(leaf);
            bvh_.nodes[index].primitives = leaf.count();
            bvh_.nodes[index].leaf = static_cast<uint32_t>(bvh_.leaves.size());
            bvh_.leaves.push_back(leaf);
            return index;
        }
        const uint32_t left = add_split(node.left), right = add_split(node.right);
        BvhNode& added = bvh_.nodes[index];
        added.left = left;
        added.right = right;
        added.primitives = bvh_.nodes[left].primitives + bvh_.nodes[right].primitives;
        return index;
    }

    // Moves the leaf's spheres from the treelet to the tree; returns where they are now.
    uint32_t take_spheres(const Leaf& leaf) {
        const auto first = static_cast<uint32_t>(bvh_.sphere_ids.size());
        const auto begin = treelet_spheres_.begin() + leaf.first_sphere;
        bvh_.sphere_ids.insert(bvh_.sphere_ids.end(), begin, begin + leaf.count());
        return first;
    }

    const World& world_;
    std::span<PrimitiveRef> refs_;
    Bvh bvh_;
    VertexTable table_;
    std::vector<SplitNode> treelets_;
    // Of the treelet at hand:
    std::vector<Leaf> leaves_;
    std::vector<uint32_t> treelet_spheres_;
    std::vector<PrimitiveRef> leaf_refs_;
    std::vector<SplitNode> splits_;
};

// Nodes with fewer primitives are not opened: a block entry costs about as much as two nodes.
constexpr uint32_t least_opened = 64;

// Opens the largest node again and again, from the root down. Their depth is bounded, since the top tree has these nodes as well.
std::vector<uint32_t> choose_block_entries(const Bvh& bvh, uint32_t max_entries) {
    struct Entry {
        double area;
        uint32_t index, depth;
        bool operator<(const Entry& other) const { return std::tie(area, index) < std::tie(other.area, other.index); }
    };
    std::priority_queue<Entry> open;
    std::vector<uint32_t> block_entries;
    const auto add = [&](uint32_t index, uint32_t depth) {
        const BvhNode& node = bvh.nodes[index];
        if (node.is_leaf() || node.primitives < least_opened || depth == RP_UPPER_TREE_MAX_DEPTH) {
            block_entries.push_back(index);
        } else {
            open.push({node.box.half_area(), index, depth});
        }
    };
    add(0, 0);
    while (!open.empty() && block_entries.size() + open.size() < max_entries) {
        const Entry entry = open.top();
        open.pop();
        add(bvh.nodes[entry.index].left, entry.depth + 1);
        add(bvh.nodes[entry.index].right, entry.depth + 1);
    }
    for (; !open.empty(); open.pop()) block_entries.push_back(open.top().index);
    // Indices grow in depth-first order.
    std::sort(block_entries.begin(), block_entries.end());
    return block_entries;
}

}  // namespace

Bvh build_bvh(const World& world, std::span<PrimitiveRef> refs, uint32_t block_entries) {
    RAYPAGER_CHECK(block_entries >= 1 && block_entries <= RP_MAX_BLOCK_ENTRIES);
    Bvh bvh = BvhBuilder(world, refs).take();
    bvh.block_entries = choose_block_entries(bvh, block_entries);
    return bvh;
}

}  // namespace raypager
