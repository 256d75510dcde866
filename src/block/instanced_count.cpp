#include "block/instanced_count.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace raypager {
namespace {

constexpr uint64_t most = std::numeric_limits<uint64_t>::max();

uint64_t sum(uint64_t a, uint64_t b) { return a > most - b ? most : a + b; }
uint64_t product(uint64_t a, uint64_t b) { return a != 0 && b > most / a ? most : a * b; }

}  // namespace

InstancedCount::InstancedCount(const BakedScene& scene) : scene_(scene), owners_(scene.objects.size() + 1) {
    uint64_t entry = 0;
    const auto first_block = [&] {
        return entry < scene.block_entries.size() ? scene.block_entries[entry].block : static_cast<uint32_t>(scene.blocks.size());
    };
    for (const rp_object& object : scene.objects) {
        first_blocks_.push_back(first_block());
        entry += object.top.block_entry_count;
    }
    first_blocks_.push_back(first_block());
}

void InstancedCount::add(uint32_t block, std::span<const std::byte> stored) {
    // Of empty objects there are no blocks: the last that begins here is meant.
    const auto behind = std::ranges::upper_bound(first_blocks_, block);
    if (behind == first_blocks_.begin()) return;
    Owner& owner = owners_[static_cast<size_t>(behind - first_blocks_.begin()) - 1];
    const BlockRecord& record = scene_.blocks[block];
    owner.primitives += uint64_t{record.triangles} + record.spheres;
    rp_block_header header;
    if (record.instances == 0 || stored.size() < sizeof header) return;
    std::memcpy(&header, stored.data(), sizeof header);
    if (header.leaves_at > stored.size()) return;
    const uint64_t fit = std::min<uint64_t>(record.instances, (stored.size() - header.leaves_at) / sizeof(rp_instance));
    for (uint64_t i = 0; i < fit; i++) {
        rp_u32 object;
        std::memcpy(&object, stored.data() + header.leaves_at + i * sizeof(rp_instance) + offsetof(rp_instance, object), sizeof object);
        if (object < scene_.objects.size()) owner.instances[object]++;
    }
}

uint64_t InstancedCount::primitives() const {
    // Objects place others of fewer levels.
    std::vector<uint32_t> order(scene_.objects.size());
    for (uint32_t i = 0; i < order.size(); i++) order[i] = i;
    std::ranges::stable_sort(order, {}, [&](uint32_t object) { return scene_.objects[object].levels; });
    std::vector<uint64_t> of_objects(order.size(), 0);
    const auto whole = [&](const Owner& owner) {
        uint64_t all = owner.primitives;
        for (const auto& [object, n] : owner.instances) all = sum(all, product(n, of_objects[object]));
        return all;
    };
    for (const uint32_t object : order) of_objects[object] = whole(owners_[object]);
    return whole(owners_.back());
}

}  // namespace raypager
