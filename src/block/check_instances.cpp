#include "block/check_instances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "block/coordinates.hpp"

namespace raypager {
namespace {

class InstanceCheck {
public:
    InstanceCheck(const BakedScene& scene, const rp_block_header& header, std::span<const std::byte> bytes)
        : scene_(scene), header_(header), bytes_(bytes) {}

    Status run(const rp_block_entry& entry) {
        levels_ = scene_.blocks[entry.block].levels;
        if (header_.block_entry_count != 1) return failed("a block of instances has one block entry");
        if (header_.attributes_at != RP_BLOCK_INSTANCES || header_.flags != 0 || header_.vertex_count != 0 || header_.sphere_count != 0 ||
            header_.triangle_count != 0)
            return failed("it holds more than instances");
        if (header_.leaf_count != scene_.blocks[entry.block].instances) return failed("the number of instances is wrong");
        if (!std::equal(entry.origin, entry.origin + 3, header_.origin) || !std::equal(entry.cell, entry.cell + 3, header_.cell))
            return failed("the grid of a block entry is not its own");
        RAYPAGER_TRY(walk(entry.root));
        return nodes_ == header_.node_count && instances_ == header_.leaf_count ? Status() : failed("some nodes or instances are never reached");
    }

private:
    static Status failed(std::string what) { return Status::failed(std::move(what)); }

    // Nodes and instances lie in the order in which they are met: so there can be no cycle, and nothing is reached twice.
    Status walk(rp_u32 root) {
        struct Entry {
            rp_u32 ref;
            int depth;
            uint64_t path;
        };
        std::vector<Entry> stack = {{root, 0, 1}};
        while (!stack.empty()) {
            const auto [ref, depth, path] = stack.back();
            stack.pop_back();
            if (ref & RP_REF_LEAF) {
                RAYPAGER_TRY(check_leaf(ref, path));
                continue;
            }
            if (ref != nodes_ || nodes_ >= header_.node_count) return failed(fmt::format("node {} is absent or out of order", ref));
            if (depth == RP_BLOCK_MAX_DEPTH) return failed("its tree is too deep");
            const auto node = item<rp_node>(header_.nodes_at, nodes_++);
            for (const uint64_t side : {1, 0}) {
                if (!is_stored_box(node.child[side])) return failed(fmt::format("the boxes of node {} make no sense", ref));
                stack.push_back({node.child[side].ref, depth + 1, path << 1 | side});
            }
        }
        return {};
    }

    Status check_leaf(rp_u32 ref, uint64_t path) {
        const uint32_t index = ref >> RP_LEAF_INDEX_SHIFT & RP_LEAF_INDEX_MASK;
        if ((ref & (RP_REF_BLOCK_ENTRY | ((1u << RP_LEAF_INDEX_SHIFT) - 1))) != (RP_REF_LEAF | RP_LEAF_INSTANCE))
            return failed(fmt::format("reference {:08x} is no instance", ref));
        if (index != instances_ || instances_ >= header_.leaf_count) return failed(fmt::format("instance {} is absent or out of order", index));
        instances_++;
        const auto record = item<rp_instance>(header_.leaves_at, index);
        if ((uint64_t{record.path_high & RP_INSTANCE_PATH_HIGH} << 32 | record.path_low) != path)
            return failed(fmt::format("the path of instance {} leads elsewhere", index));
        if (record.object >= scene_.objects.size() || scene_.objects[record.object].top.root == RP_REF_EXIT)
            return failed(fmt::format("instance {} is of an object that does not exist, or has nothing in it", index));
        if (scene_.objects[record.object].levels >= levels_) return failed(fmt::format("instance {} is of an object that may hold it", index));
        if (item<rp_u32>(header_.leaves_at + header_.leaf_count * uint64_t{sizeof(rp_instance)}, index) >= scene_.instances)
            return failed(fmt::format("instance {} has a number that does not exist", index));
        RAYPAGER_TRY(check_traits(record, index));
        return check_placement(record, index);
    }

    // Neighbours are often of the same object.
    bool shines(uint32_t object) {
        if (object != last_object_) {
            last_object_ = object;
            last_shines_ = scene_.lights_of_object(object) > 0;
        }
        return last_shines_;
    }

    // What shines has lights in each place.
    Status check_traits(const rp_instance& record, uint32_t index) {
        const uint32_t number = record.path_high >> RP_INSTANCE_TRAITS_SHIFT;
        if (number > scene_.instance_traits.size()) return failed(fmt::format("instance {} has traits that do not exist", index));
        const rp_u32 of_object = number > 0 ? scene_.instance_traits[number - 1].object : RP_NONE;
        if (of_object != RP_NONE && of_object != record.object) return failed(fmt::format("instance {} has the lights of another object", index));
        if (of_object == RP_NONE && shines(record.object)) return failed(fmt::format("instance {} has no lights", index));
        return {};
    }

    // As make_instance has it (world/instance_record.hpp).
    static Status check_placement(const rp_instance& record, uint32_t index) {
        Transform linear;
        bool finite = is_stored_coordinate(record.reach) && record.reach >= 0;
        for (size_t i = 0; i < 3; i++) {
            finite = finite && is_stored_coordinate(record.center[i]);
            for (size_t j = 0; j < 3; j++) {
                finite = finite && std::isfinite(record.to_object[3 * i + j]);
                linear.m[i][j] = record.to_object[3 * i + j];
            }
        }
        if (!finite) return failed(fmt::format("instance {} is not finite, or too far away", index));
        return linear.inverse() ? Status() : failed(fmt::format("instance {} is flat", index));
    }

    template <class T>
    T item(uint64_t section_at, uint64_t index) const {
        T value;
        std::memcpy(&value, bytes_.data() + section_at + index * sizeof(T), sizeof(T));
        return value;
    }

    const BakedScene& scene_;
    const rp_block_header& header_;
    const std::span<const std::byte> bytes_;
    uint64_t nodes_ = 0, instances_ = 0;
    uint32_t last_object_ = RP_NONE;
    bool last_shines_ = false;  // that one
    uint32_t levels_ = 0;       // of instances, in what the block is part of
};

}  // namespace

Status check_instances(const BakedScene& scene, const rp_block_header& header, const rp_block_entry& entry, std::span<const std::byte> bytes) {
    return InstanceCheck(scene, header, bytes).run(entry);
}

}  // namespace raypager
