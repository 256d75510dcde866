#include "pack/pack.hpp"

#include <bit>
#include <cstring>
#include <span>

#include "base/check.hpp"
#include "block/block_coding.hpp"
#include "block/grid.hpp"
#include "pack/pack_instances.hpp"
#include "pack/vertex_windows.hpp"
#include "pack/wide_size.hpp"

namespace raypager {
namespace {

constexpr uint64_t section_alignment = 16;
constexpr uint64_t largest_window = uint64_t{0xffff} * RP_CLUSTER_UNIT;

uint64_t align(uint64_t value, uint64_t alignment) { return (value + alignment - 1) / alignment * alignment; }

class Packer {
public:
    Packer(const World& world, const Bvh& bvh, float position_cell)
        : world_(world),
          bvh_(bvh),
          position_cell_(position_cell),
          grid_(make_grid(bvh.nodes[0].box)),
          windows_(static_cast<uint32_t>(bvh.vertices.size())) {}

    bool run(uint64_t limit, PackedBlock& block) {
        add_spheres();
        nodes_.resize(bvh_.block_entries.size() - 1);
        for (const uint32_t block_entry : bvh_.block_entries)
            block.block_entries.push_back({bvh_.nodes[block_entry].box, add_subtree(block_entry), 0, 0});
        add_upper_tree(0, 0, block.block_entries);
        if (out_of_reach_) return false;
        code();
        if (!layout(limit)) return false;
        block.bounds = bvh_.nodes[0].box;
        block.triangles = bvh_.triangles;
        block.spheres = static_cast<uint32_t>(spheres_.size());
        write(block.bytes);
        measure_wide_form(block);
        return true;
    }

private:
    void measure_wide_form(PackedBlock& block) const {
        const WideSize size = raypager::measure_wide_form(bvh_, spheres_);
        block.wide_bytes = size.bytes;
        for (size_t i = 0; i < size.roots.size(); i++) block.block_entries[i].wide_root = size.roots[i];
    }

    // Appends a subtree in depth-first order; returns the reference to its root.
    rp_u32 add_subtree(uint32_t index) {
        const BvhNode& node = bvh_.nodes[index];
        if (node.is_leaf()) return add_leaf(bvh_.leaves[node.leaf]);
        const auto place = static_cast<rp_u32>(nodes_.size());
        nodes_.emplace_back();
        const uint32_t children[2] = {node.left, node.right};
        for (int side = 0; side < 2; side++) {
            const rp_u32 ref = add_subtree(children[side]);
            nodes_[place].child[side] = quantise(grid_, bvh_.nodes[children[side]].box, ref);
        }
        return place;
    }

    // The nodes above the block entries, in depth-first order, before all others. Block entries are met from left to right.
    rp_u32 add_upper_tree(uint32_t index, uint32_t depth, std::span<PackedBlockEntry> block_entries) {
        if (bvh_.block_entries[upper_block_entries_] == index) {
            block_entries[upper_block_entries_].depth = depth;
            return block_entries[upper_block_entries_++].root;
        }
        const rp_u32 place = upper_nodes_++;
        const uint32_t children[2] = {bvh_.nodes[index].left, bvh_.nodes[index].right};
        for (int side = 0; side < 2; side++) {
            const rp_u32 ref = add_upper_tree(children[side], depth + 1, block_entries);
            nodes_[place].child[side] = quantise(grid_, bvh_.nodes[children[side]].box, ref);
        }
        return place;
    }

    rp_u32 add_leaf(const Leaf& leaf) {
        const auto index = leaf.has_spheres() ? leaf.first_sphere : static_cast<rp_u32>(leaves_.size());
        RAYPAGER_CHECK(index <= RP_LEAF_INDEX_MASK);
        if (!leaf.has_spheres()) {
            leaves_.push_back(add_strip(leaf));
            for (const uint32_t id : leaf.ids) ids_.push_back(id == RP_NONE ? RP_NONE : world_.id(id));
        }
        return RP_REF_LEAF | index << RP_LEAF_INDEX_SHIFT | leaf.flags;
    }

    rp_leaf add_strip(const Leaf& leaf) {
        const VertexWindows::Reference ref = windows_.place(leaf.vertices, leaf.count() + 2);
        if (ref.first > largest_window) out_of_reach_ = true;
        const auto& b = ref.bytes;
        return {(ref.first / RP_CLUSTER_UNIT & 0xffffu) | rp_u32{b[0]} << 16 | rp_u32{b[1]} << 24,
                b[2] | rp_u32{b[3]} << 8 | rp_u32{b[4]} << 16 | rp_u32{b[5]} << 24};
    }

    void add_spheres() {
        for (const uint32_t id : bvh_.sphere_ids) {
            const WorldSphere& s = world_.sphere(id);
            spheres_.push_back({{s.center.x, s.center.y, s.center.z}, s.is_point() ? s.point_word : std::bit_cast<rp_u32>(s.radius)});
            sphere_ids_.push_back(world_.id(id));
        }
    }

    void code() {
        header_.leaf_count = static_cast<rp_u32>(leaves_.size());
        header_.vertex_count = static_cast<rp_u32>(windows_.sequence().size());
        std::vector<Float3> positions;
        for (const uint32_t v : windows_.sequence()) {
            positions.push_back(bvh_.vertices[v].position);
        }
        if (bvh_.attributes.normals) add_attribute(RP_BLOCK_NORMALS, &VertexBits::normal);
        if (bvh_.attributes.colors) add_attribute(RP_BLOCK_COLORS, &VertexBits::color);
        if (bvh_.attributes.uvs)
            for (const uint32_t v : windows_.sequence())
                for (const float coordinate : {bvh_.vertices[v].uv.x, bvh_.vertices[v].uv.y})
                    attributes_.push_back(std::bit_cast<rp_u32>(coordinate));
        positions_ = code_positions(positions, position_cell_, header_);
        coded_ids_ = code_ids(ids_, header_);
        header_.flags |= attribute_flags_;
    }

    void add_attribute(rp_u32 flag, uint32_t VertexBits::*attribute) {
        attribute_flags_ |= flag;
        for (const uint32_t v : windows_.sequence()) attributes_.push_back(bvh_.vertices[v].*attribute);
    }

    bool layout(uint64_t limit) {
        uint64_t end = sizeof header_;
        const auto section = [&end](uint64_t bytes) {
            const uint64_t start = end;
            end = align(end + bytes, section_alignment);
            return static_cast<rp_u32>(start);
        };
        header_.nodes_at = section(nodes_.size() * sizeof(rp_node));
        header_.leaves_at = section(leaves_.size() * sizeof(rp_leaf));
        header_.vertices_at = section(positions_.size());
        header_.spheres_at = section(spheres_.size() * (sizeof(rp_sphere) + sizeof(rp_u32)));
        header_.ids_at = section(coded_ids_.size());
        header_.attributes_at = attributes_.empty() ? 0 : section(attributes_.size() * sizeof(rp_u32)) | (bvh_.attributes.uvs ? RP_BLOCK_UVS : 0);
        end = align(end, RP_BLOCK_ALIGNMENT);
        if (end > limit) return false;
        header_.bytes = static_cast<rp_u32>(end);
        return true;
    }

    void write(std::vector<std::byte>& bytes) {
        header_.magic = RP_BLOCK_MAGIC;
        header_.node_count = static_cast<rp_u32>(nodes_.size());
        header_.sphere_count = static_cast<rp_u32>(spheres_.size());
        header_.triangle_count = bvh_.triangles;
        header_.block_entry_count = static_cast<rp_u32>(bvh_.block_entries.size());
        for (int a = 0; a < 3; a++) {
            header_.origin[a] = grid_.origin[a];
            header_.cell[a] = grid_.cell[a];
            header_.lower[a] = bvh_.nodes[0].box.lower[a];
            header_.upper[a] = bvh_.nodes[0].box.upper[a];
        }
        bytes.assign(header_.bytes, std::byte{0});
        const auto put = [&bytes](rp_u32 at, const auto& items) {
            if (!items.empty()) std::memcpy(bytes.data() + at, items.data(), items.size() * sizeof items[0]);
        };
        std::memcpy(bytes.data(), &header_, sizeof header_);
        put(header_.nodes_at, nodes_);
        put(header_.leaves_at, leaves_);
        put(header_.vertices_at, positions_);
        put(header_.spheres_at, spheres_);
        put(header_.spheres_at + static_cast<rp_u32>(spheres_.size() * sizeof(rp_sphere)), sphere_ids_);
        put(header_.ids_at, coded_ids_);
        if (header_.attributes_at) put(RP_BLOCK_ATTRIBUTES_AT(header_.attributes_at), attributes_);
    }

    static_assert(sizeof(rp_block_header) == 128 && sizeof(rp_node) == 32 && sizeof(rp_leaf) == 8);
    static_assert(sizeof(Float3) == 12 && sizeof(rp_sphere) == 16);

    const World& world_;
    const Bvh& bvh_;
    const float position_cell_;
    const Grid grid_;
    VertexWindows windows_;
    rp_block_header header_ = {};
    std::vector<rp_node> nodes_;
    rp_u32 upper_nodes_ = 0, upper_block_entries_ = 0;  // so far
    std::vector<rp_leaf> leaves_;
    std::vector<rp_sphere> spheres_;
    std::vector<rp_u32> sphere_ids_, ids_, attributes_;
    rp_u32 attribute_flags_ = 0;
    std::vector<std::byte> positions_, coded_ids_;
    bool out_of_reach_ = false;
};

}  // namespace

bool pack(const World& world, const Bvh& bvh, uint64_t limit, float position_cell, PackedBlock& block) {
    if (!world.instances.empty()) return pack_instances(world, bvh, limit, block);
    return Packer(world, bvh, position_cell).run(limit, block);
}

}  // namespace raypager
