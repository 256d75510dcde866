#include "block/baked_scene.hpp"

#include <algorithm>
#include <span>

#include "base/hash.hpp"

namespace raypager {
namespace {

class Hasher {
public:
    template <class Items>
    void add_all(const Items& items) {
        const uint64_t count = std::size(items);
        add(count);
        value = hash64(std::as_bytes(std::span(items)), value);
    }
    template <class T>
    void add(const T& item) {
        static_assert(std::is_trivially_copyable_v<T>);
        value = hash64(std::as_bytes(std::span(&item, 1)), value);
    }
    uint64_t value = 0;
};

}  // namespace

uint64_t BakedScene::geometry_bytes(BlockForm form) const {
    uint64_t sum = 0;
    for (const BlockRecord& block : blocks) sum += block.bytes(form);
    return sum;
}

uint32_t BakedScene::largest_block(BlockForm form) const {
    uint32_t largest = 0;
    for (const BlockRecord& block : blocks) largest = std::max(largest, block.bytes(form));
    return largest;
}

bool BakedScene::has_cutouts() const {
    return std::any_of(ranges.begin(), ranges.end(), [](const rp_primitive_range& range) { return range.flags & RP_RANGE_CUTOUT; });
}

bool BakedScene::has_vertex_colors() const {
    return std::any_of(ranges.begin(), ranges.end(), [](const rp_primitive_range& range) { return range.flags & RP_RANGE_VERTEX_COLOR; });
}

bool BakedScene::has_uvs() const {
    return std::any_of(ranges.begin(), ranges.end(), [](const rp_primitive_range& range) { return range.flags & RP_RANGE_UV; });
}

BlockEntryRoots BakedScene::block_entries_of(uint32_t block) const {
    const auto first = std::partition_point(block_entries.begin(), block_entries.end(),
                                            [block](const rp_block_entry& block_entry) { return block_entry.block < block; });
    BlockEntryRoots result;
    for (size_t i = static_cast<size_t>(first - block_entries.begin()); i < block_entries.size() && block_entries[i].block == block; i++) {
        result.roots.push_back(block_entries[i].root);
        result.wide_roots.push_back(wide_roots[i]);
    }
    return result;
}

uint64_t BakedScene::identity() const {
    Hasher hasher;
    hasher.add(camera);
    hasher.add(filter);
    for (const uint64_t value : {uint64_t{width}, uint64_t{height}, uint64_t{spp}, uint64_t{max_depth}, triangles, spheres}) hasher.add(value);
    // The rest of the film's response comes in when the picture is made of the samples.
    hasher.add(film.max_luminance);
    hasher.add(film.max_xyz);
    hasher.add_all(lower);
    hasher.add_all(upper);
    hasher.add_all(materials);
    hasher.add_all(lights);
    for (const auto& image : light_images) {
        hasher.add(uint64_t{image->width} << 32 | image->height);
        hasher.add_all(image->texels);
    }
    hasher.add_all(ranges);
    hasher.add(top_grid);
    hasher.add_all(top_nodes);
    hasher.add_all(block_entries);
    hasher.add_all(block_entry_paths);
    // Where a block lies in the file does not matter.
    for (const BlockRecord& block : blocks) {
        hasher.add(block.checksum);
        hasher.add(block.stored_bytes);
    }
    return hasher.value;
}

}  // namespace raypager
