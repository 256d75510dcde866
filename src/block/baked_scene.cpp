#include "block/baked_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "base/hash.hpp"
#include "scene/image_levels.hpp"
#include "scene/texture_use.hpp"

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

bool BakedScene::has_bumps() const {
    return std::any_of(texture_ops.begin(), texture_ops.end(), [](const rp_texture_op& op) {
        const uint32_t kind = op.op & RP_TEXTURE_OPERATION_MASK;
        return kind == RP_TEXTURE_BUMP || (kind == RP_TEXTURE_SET && op.image == RP_PARAMETER_NORMAL);
    });
}

bool BakedScene::is_anisotropic() const { return std::any_of(materials.begin(), materials.end(), raypager::is_anisotropic); }

bool BakedScene::has_cutouts() const {
    return std::any_of(ranges.begin(), ranges.end(), [](const rp_primitive_range& range) { return range.flags & RP_RANGE_CUTOUT; });
}

std::string BakedScene::pageable_name(uint32_t pageable) const {
    return is_page(pageable) ? fmt::format("page {} of images", pageable - blocks.size()) : fmt::format("block {}", pageable);
}

uint32_t BakedScene::largest_pageable(BlockForm form) const { return std::max(largest_block(form), pages.empty() ? 0 : RP_TEXTURE_PAGE_BYTES); }

uint32_t BakedScene::texel_words() const {
    uint32_t words = 0;
    for (const rp_texture_op& op : texture_ops)
        if ((op.op & RP_TEXTURE_OPERATION_MASK) == RP_TEXTURE_IMAGE)
            words = std::max(words, op.lookup + raypager::texel_words(images[op.image].format));
    return words;
}

uint32_t BakedScene::instance_levels() const {
    if (instances == 0) return 0;
    uint32_t levels = 0;
    for (const rp_object& object : objects) levels = std::max(levels, object.levels);
    return levels + 1;
}

bool BakedScene::has_vertex_colors() const {
    return std::any_of(ranges.begin(), ranges.end(), [](const rp_primitive_range& range) { return range.flags & RP_RANGE_VERTEX_COLOR; });
}

bool BakedScene::has_uvs() const {
    return std::any_of(ranges.begin(), ranges.end(), [](const rp_primitive_range& range) { return range.flags & RP_RANGE_UV; });
}

uint32_t BakedScene::first_block_entry_of(uint32_t block) const {
    const auto first = std::partition_point(block_entries.begin(), block_entries.end(),
                                            [block](const rp_block_entry& block_entry) { return block_entry.block < block; });
    return static_cast<uint32_t>(first - block_entries.begin());
}

BlockEntryRoots BakedScene::block_entries_of(uint32_t block) const {
    BlockEntryRoots result;
    for (size_t i = first_block_entry_of(block); i < block_entries.size() && block_entries[i].block == block; i++) {
        result.roots.push_back(block_entries[i].root);
        result.wide_roots.push_back(wide_roots[i]);
    }
    return result;
}

std::span<const rp_primitive_range> BakedScene::ranges_of_object(size_t object) const {
    const size_t first = objects[object].first_range, end = object + 1 < objects.size() ? objects[object + 1].first_range : ranges.size();
    return std::span(ranges).subspan(first, end - first);
}

uint64_t BakedScene::lights_of_object(size_t object) const {
    uint64_t count = 0;
    for (const rp_primitive_range& range : ranges_of_object(object))
        if (range.first_light != RP_NONE) count += end_of_range(static_cast<size_t>(&range - ranges.data())) - range.first_primitive;
    return count;
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
    // Other scenes have the identity that they had before there were instances.
    if (!objects.empty()) {
        hasher.add(instances);
        hasher.add_all(objects);
        hasher.add_all(instance_traits);
    }
    if (texture_ops.empty() && !has_paged_sky()) return hasher.value;
    if (has_paged_sky()) hasher.add_all(sky_words);
    hasher.add_all(images);
    hasher.add_all(image_levels);
    hasher.add_all(texture_ops);
    hasher.add_all(texture_maps);
    for (const PageRecord& page : pages) hasher.add(page.checksum);
    return hasher.value;
}

}  // namespace raypager
