#include "block/check_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "block/block_coding.hpp"
#include "block/check_instances.hpp"
#include "block/coordinates.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {
namespace {

bool is_stored(const Float3& p) { return is_stored_coordinate(p.x) && is_stored_coordinate(p.y) && is_stored_coordinate(p.z); }

// A vector and the first three of four.
bool same(const float (&a)[3], const float (&b)[4]) { return std::equal(std::begin(a), std::end(a), std::begin(b)); }

Status bad(std::string what) { return Status::failed(std::move(what)); }

class BlockCheck {
public:
    BlockCheck(const BakedScene& scene, uint32_t block, std::span<const std::byte> bytes) : scene_(scene), block_(block), bytes_(bytes) {}

    Status run() {
        RAYPAGER_TRY(check_header());
        const auto& block_entries = scene_.block_entries;
        const auto first = std::partition_point(block_entries.begin(), block_entries.end(),
                                                [&](const rp_block_entry& block_entry) { return block_entry.block < block_; });
        const auto end =
            std::partition_point(first, block_entries.end(), [&](const rp_block_entry& block_entry) { return block_entry.block == block_; });
        if (end - first != static_cast<ptrdiff_t>(header_.block_entry_count)) return bad("the number of block entries is wrong");
        if (header_.block_entry_count == 0) return bad("the number of block entries is wrong");
        if (holds_instances(header_)) return check_instances(scene_, header_, *first, bytes_);
        if (header_.node_count < header_.block_entry_count - 1) return bad("the number of block entries is wrong");
        RAYPAGER_TRY(check_numbers());
        seen_leaves_.resize(header_.leaf_count);
        ids_.emplace(header_, bytes_.data() + header_.ids_at);
        all_ids_are_good_ = ids_->all_below(primitives());
        RAYPAGER_TRY(check_upper_tree(std::span(first, end)));
        for (size_t i = 0; i < header_.block_entry_count; i++)
            RAYPAGER_TRY(check_block_entry(first[static_cast<ptrdiff_t>(i)], block_entry_depths_[i]));
        if (nodes_ != header_.node_count || leaves_ != header_.leaf_count) return bad("some nodes or leaves are never reached");
        if (triangles_ != header_.triangle_count || spheres_ != header_.sphere_count) return bad("the number of primitives is wrong");
        return {};
    }

private:
    Status check_header() {
        const BlockRecord& record = scene_.blocks[block_];
        if (bytes_.size() < sizeof header_) return bad("it is shorter than its header");
        std::memcpy(&header_, bytes_.data(), sizeof header_);
        if (header_.magic != RP_BLOCK_MAGIC) return bad("it does not begin with \"RBLK\"");
        if (header_.block_index != block_) return bad("its header is that of another block");
        if (!good_coding(header_, scene_.position_cell)) return bad("how its positions and ids are coded makes no sense");
        if (header_.bytes != bytes_.size() || header_.bytes != record.stored_bytes) return bad("its size is wrong");
        if (header_.triangle_count != record.triangles || header_.sphere_count != record.spheres) return bad("the number of primitives is wrong");
        if (!same(record.lower, header_.lower) || !same(record.upper, header_.upper)) return bad("its bounds are wrong");
        if (header_.leaf_count > RP_LEAF_INDEX_MASK + 1 || header_.sphere_count > RP_LEAF_INDEX_MASK + 1) return bad("it has too many leaves");
        // Kernels of a scene without any do not know of them.
        if (RP_BLOCK_HAS_UVS(header_.attributes_at) && !scene_.has_uvs())
            return bad("it has coordinates of textures, which no part of the scene has");
        if ((record.instances > 0) != holds_instances(header_)) return bad("it holds instances where others are expected, or the other way about");
        if (header_.nodes_at != sizeof header_) return bad("its nodes are not behind its header");
        return check_sections();
    }

    Status check_sections() const {
        struct {
            const char* name;
            uint64_t at, bytes;
        } const sections[] = {
            {"nodes", header_.nodes_at, header_.node_count * uint64_t{sizeof(rp_node)}},
            {"leaves", header_.leaves_at, leaf_bytes(header_)},
            {"vertices", header_.vertices_at, position_bytes(header_)},
            {"spheres", header_.spheres_at, header_.sphere_count * uint64_t{sizeof(rp_sphere) + sizeof(rp_u32)}},
            {"ids", header_.ids_at, id_bytes(header_)},
            {"attributes", RP_BLOCK_ATTRIBUTES_AT(header_.attributes_at), attribute_bytes(header_)},
        };
        uint64_t end = sizeof header_;
        for (const auto& section : sections) {
            if (section.at == 0 && section.bytes == 0 && section.name == std::string_view("attributes")) continue;
            if (section.at % 16 != 0 || section.at < end || section.at > bytes_.size() || section.bytes > bytes_.size() - section.at)
                return bad(fmt::format("the section \"{}\" does not lie within it", section.name));
            end = section.at + section.bytes;
        }
        return {};
    }

    template <class T>
    T item(uint64_t section_at, uint64_t index) const {
        T value;
        std::memcpy(&value, bytes_.data() + section_at + index * sizeof(T), sizeof(T));
        return value;
    }

    rp_u32 child_of(uint64_t node, uint32_t side) const { return item<rp_child>(header_.nodes_at + node * sizeof(rp_node), side).ref; }

    Status check_numbers() const {
        const BlockPositions positions(header_, bytes_.data() + header_.vertices_at);
        if (const auto range = positions.range(); !range || !is_stored((*range)[0]) || !is_stored((*range)[1]))
            for (uint32_t i = 0; i < header_.vertex_count; i++)
                if (!is_stored(positions[i])) return bad(fmt::format("vertex {} is not finite, or too far away", i));
        for (uint32_t i = 0; i < header_.vertex_count && RP_BLOCK_HAS_UVS(header_.attributes_at); i++) {
            const auto uv = item<Float2>(uvs_at(header_), i);
            if (!(std::abs(uv.x) <= largest_uv && std::abs(uv.y) <= largest_uv))
                return bad(fmt::format("vertex {} has coordinates of textures that are not finite, or too large", i));
        }
        for (uint64_t i = 0; i < header_.sphere_count; i++) {
            for (const float value : item<rp_sphere>(header_.spheres_at, i).center)
                if (!is_stored_coordinate(value)) return bad(fmt::format("sphere {} is not finite, or too far away", i));
            if (item<rp_u32>(header_.spheres_at + header_.sphere_count * uint64_t{sizeof(rp_sphere)}, i) >= primitives())
                return bad(fmt::format("sphere {} is a primitive that does not exist", i));
        }
        return {};
    }

    // The nodes above the block entries.
    Status check_upper_tree(std::span<const rp_block_entry> block_entries) {
        const uint32_t upper = header_.block_entry_count - 1;
        struct Entry {
            rp_u32 ref;
            int depth;
        };
        std::vector<Entry> stack = {{upper == 0 ? block_entries[0].root : 0, 0}};
        while (!stack.empty()) {
            const auto [ref, depth] = stack.back();
            stack.pop_back();
            if (block_entry_depths_.size() < block_entries.size() && ref == block_entries[block_entry_depths_.size()].root &&
                (ref & RP_REF_LEAF || ref >= upper)) {
                block_entry_depths_.push_back(depth);
                continue;
            }
            if (ref != nodes_ || nodes_ >= upper) return bad(fmt::format("reference {:08x} above its block entries is out of order", ref));
            if (depth == RP_UPPER_TREE_MAX_DEPTH) return bad("its tree is too deep");
            const auto node = item<rp_node>(header_.nodes_at, nodes_++);
            for (const int side : {1, 0}) stack.push_back({node.child[side].ref, depth + 1});
        }
        return nodes_ == upper && block_entry_depths_.size() == block_entries.size() ? Status() : bad("some of its block entries are never reached");
    }

    Status check_block_entry(const rp_block_entry& block_entry, int depth_of_root) {
        if (!same(block_entry.origin, header_.origin) || !same(block_entry.cell, header_.cell))
            return bad("the grid of a block entry is not its own");
        struct Entry {
            rp_u32 ref;
            int depth;
        };
        std::array<Entry, RP_BLOCK_MAX_DEPTH> stack;  // right children that wait, no two of them at one depth
        size_t waiting = 0;
        rp_u32 ref = block_entry.root;
        int depth = depth_of_root;
        for (;;) {
            // Depth-first order over all block entries: so there can be no cycle, and nothing is reached twice.
            while (!(ref & RP_REF_LEAF)) {
                if (ref != nodes_ || nodes_ >= header_.node_count) return bad(fmt::format("node {} is absent or out of order", ref));
                if (depth == RP_BLOCK_MAX_DEPTH) return bad("its tree is too deep");
                stack[waiting++] = {child_of(nodes_, 1), ++depth};
                ref = child_of(nodes_++, 0);
            }
            RAYPAGER_TRY(check_leaf(ref));
            if (waiting == 0) return {};
            ref = stack[--waiting].ref;
            depth = stack[waiting].depth;
        }
    }

    Status check_leaf(rp_u32 ref) {
        if (ref & (RP_REF_BLOCK_ENTRY ^ RP_REF_LEAF)) return bad(fmt::format("reference {:08x} leads out of it", ref));
        const uint32_t index = ref >> RP_LEAF_INDEX_SHIFT & RP_LEAF_INDEX_MASK;
        return ref & RP_LEAF_SPHERES ? check_spheres(ref, index) : check_strip(ref, index);
    }

    // Spheres lie in the order in which their leaves are met.
    Status check_spheres(rp_u32 ref, uint32_t first) {
        const uint32_t count = (ref & (RP_LEAF_MAX_SPHERES - 1)) + 1;
        if (first != spheres_ || uint64_t{first} + count > header_.sphere_count || (ref & 0x10u /* bit 4 is not used */))
            return bad(fmt::format("a leaf of spheres, reference {:08x}, is out of order", ref));
        for (uint32_t i = first; i < first + count; i++) {
            const rp_u32 word = item<rp_sphere>(header_.spheres_at, i).word;
            const float radius = std::bit_cast<float>(word);
            if (ref & RP_LEAF_POINTS ? (word & 255u) > RP_POINT_LARGEST_CODE : !(radius > 0 && is_stored_coordinate(radius)))
                return bad(fmt::format("sphere {} has no radius", i));
        }
        spheres_ += count;
        return {};
    }

    Status check_strip(rp_u32 ref, uint32_t index) {
        const uint32_t count = (ref & 3u) + 1;
        if (index >= header_.leaf_count || seen_leaves_[index]) return bad(fmt::format("leaf {} is absent or reached twice", index));
        seen_leaves_[index] = true;
        leaves_++;
        const auto leaf = item<rp_leaf>(header_.leaves_at, index);
        // Kernels may load all six vertices of a strip, however short it is.
        const uint64_t first = uint64_t{leaf.lo & 0xffffu} * RP_CLUSTER_UNIT;
        const uint64_t bytes = leaf.lo >> 16 | uint64_t{leaf.hi} << 16;
        const auto exists = [&](int i) { return first + (bytes >> 8 * i & 255u) < header_.vertex_count; };
        const bool all_exist = first + 255u < header_.vertex_count || (exists(0) && exists(1) && exists(2) && exists(3) && exists(4) && exists(5));
        if (!all_exist) return bad(fmt::format("leaf {} names a vertex that does not exist", index));
        triangles_ += count;
        if (!all_ids_are_good_ && !good_ids(index, count)) return bad(fmt::format("leaf {} names a primitive that does not exist", index));
        return {};
    }

    bool good_ids(uint32_t leaf, uint32_t count) const {
        for (uint32_t k = 0; k < RP_LEAF_MAX_PRIMITIVES; k++) {
            const rp_u32 id = (*ids_)(leaf, k);
            if (k < count ? id >= primitives() : !(header_.flags & RP_IDS_CODED) && id != RP_NONE) return false;
        }
        return true;
    }

    uint64_t primitives() const { return scene_.triangles + scene_.spheres; }

    const BakedScene& scene_;
    const uint32_t block_;
    const std::span<const std::byte> bytes_;
    rp_block_header header_ = {};
    std::vector<bool> seen_leaves_;
    std::optional<BlockIds> ids_;
    bool all_ids_are_good_ = false;  // by their coding alone
    std::vector<int> block_entry_depths_;
    uint64_t nodes_ = 0, leaves_ = 0, triangles_ = 0, spheres_ = 0;
};

}  // namespace

Status check_block_bytes(const BakedScene& scene, uint32_t block, std::span<const std::byte> bytes) { return BlockCheck(scene, block, bytes).run(); }

}  // namespace raypager
