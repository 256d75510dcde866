#include "pack/pack_instances.hpp"

#include <algorithm>
#include <cstring>

#include "base/check.hpp"
#include "block/grid.hpp"
#include "block/wide_block.hpp"

namespace raypager {
namespace {

class InstancePacker {
public:
    InstancePacker(const World& world, const Bvh& bvh) : world_(world), bvh_(bvh), grid_(make_grid(bvh.nodes[0].box)) {}

    bool run(uint64_t limit, PackedBlock& block) {
        RAYPAGER_CHECK(bvh_.block_entries.size() == 1);
        const rp_u32 root = add_subtree(0, 1);
        if (!layout(limit)) return false;
        block.bounds = bvh_.nodes[0].box;
        block.instances = header_.leaf_count;
        write(block.bytes);
        WideBlockMaker wide;
        block.wide_bytes = static_cast<uint32_t>(wide.make(block.bytes, std::span(&root, 1)).size());
        block.block_entries.push_back({bvh_.nodes[0].box, root, wide.roots()[0], 0});
        return true;
    }

private:
    // In depth-first order; path: of abi/instance.h.
    rp_u32 add_subtree(uint32_t index, uint64_t path) {
        const BvhNode& node = bvh_.nodes[index];
        if (node.is_leaf()) return add_instance(world_.instance(bvh_.leaves[node.leaf].ids[0]), path);
        const auto place = static_cast<rp_u32>(nodes_.size());
        nodes_.emplace_back();
        const uint32_t children[2] = {node.left, node.right};
        for (uint32_t side = 0; side < 2; side++) {
            const rp_u32 ref = add_subtree(children[side], path << 1 | side);
            nodes_[place].child[side] = quantise(grid_, bvh_.nodes[children[side]].box, ref);
        }
        return place;
    }

    rp_u32 add_instance(const WorldInstance& instance, uint64_t path) {
        const auto index = static_cast<rp_u32>(instances_.size());
        RAYPAGER_CHECK(index <= RP_LEAF_INDEX_MASK);
        instances_.push_back(instance.record);
        instances_.back().path_low = static_cast<rp_u32>(path);
        instances_.back().path_high |= static_cast<rp_u32>(path >> 32);  // beside the number of its traits
        numbers_.push_back(instance.number);
        return RP_REF_LEAF | index << RP_LEAF_INDEX_SHIFT | RP_LEAF_INSTANCE;
    }

    bool layout(uint64_t limit) {
        static_assert(sizeof(rp_block_header) % 16 == 0 && sizeof(rp_node) % 16 == 0, "sections start at multiples of 16 bytes");
        const auto align = [](uint64_t value, uint64_t alignment) { return (value + alignment - 1) / alignment * alignment; };
        const uint64_t leaves_at = sizeof header_ + nodes_.size() * sizeof(rp_node);
        const uint64_t end = align(leaves_at + instances_.size() * (sizeof(rp_instance) + sizeof(rp_u32)), 16);
        const uint64_t bytes = align(end, RP_BLOCK_ALIGNMENT);
        if (bytes > limit) return false;
        header_.nodes_at = sizeof header_;
        header_.leaves_at = static_cast<rp_u32>(leaves_at);
        header_.vertices_at = header_.spheres_at = header_.ids_at = static_cast<rp_u32>(end);
        header_.attributes_at = RP_BLOCK_INSTANCES;
        header_.bytes = static_cast<rp_u32>(bytes);
        header_.magic = RP_BLOCK_MAGIC;
        header_.node_count = static_cast<rp_u32>(nodes_.size());
        header_.leaf_count = static_cast<rp_u32>(instances_.size());
        header_.block_entry_count = 1;
        std::copy_n(grid_.origin, 3, header_.origin);
        std::copy_n(grid_.cell, 3, header_.cell);
        std::copy_n(bvh_.nodes[0].box.lower, 3, header_.lower);
        std::copy_n(bvh_.nodes[0].box.upper, 3, header_.upper);
        return true;
    }

    void write(std::vector<std::byte>& bytes) const {
        bytes.assign(header_.bytes, std::byte{0});
        std::memcpy(bytes.data(), &header_, sizeof header_);
        if (!nodes_.empty()) std::memcpy(bytes.data() + header_.nodes_at, nodes_.data(), nodes_.size() * sizeof(rp_node));
        const size_t record_bytes = instances_.size() * sizeof(rp_instance);
        std::memcpy(bytes.data() + header_.leaves_at, instances_.data(), record_bytes);
        std::memcpy(bytes.data() + header_.leaves_at + record_bytes, numbers_.data(), numbers_.size() * sizeof(rp_u32));
    }

    static_assert(sizeof(rp_instance) == 64);

    const World& world_;
    const Bvh& bvh_;
    const Grid grid_;
    rp_block_header header_ = {};
    std::vector<rp_node> nodes_;
    std::vector<rp_instance> instances_;
    std::vector<rp_u32> numbers_;
};

}  // namespace

bool pack_instances(const World& world, const Bvh& bvh, uint64_t limit, PackedBlock& block) { return InstancePacker(world, bvh).run(limit, block); }

}  // namespace raypager
