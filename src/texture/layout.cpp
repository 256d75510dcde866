#include "texture/layout.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "block/baked_scene.hpp"
#include "scene/image_levels.hpp"

namespace raypager {
namespace {

// Puts each tail into the first of the last few pages that has room for it.
class TailPacker {
public:
    // The page, and the first byte in it.
    std::pair<uint32_t, uint32_t> place(uint32_t bytes, std::vector<uint32_t>& tails) {
        constexpr size_t most_open = 16;
        const size_t first = used_.size() - std::min(used_.size(), most_open);
        for (size_t page = first; page < used_.size(); page++)
            if (used_[page] + bytes <= RP_TEXTURE_PAGE_BYTES) return take(page, bytes, tails);
        used_.push_back(0);
        tails.push_back(0);
        return take(used_.size() - 1, bytes, tails);
    }

private:
    std::pair<uint32_t, uint32_t> take(size_t page, uint32_t bytes, std::vector<uint32_t>& tails) {
        const uint32_t at = used_[page];
        used_[page] += bytes;
        tails[page]++;
        return {static_cast<uint32_t>(page), at};
    }

    std::vector<uint32_t> used_;
};

void add_levels(const ImageShape& shape, ImageLayout& layout) {
    rp_image image = {static_cast<rp_u32>(layout.levels.size()), 0, format_of(shape), shape.srgb ? 1u : 0u};
    for (uint32_t width = shape.width, height = shape.height;; width = next_level_size(width), height = next_level_size(height)) {
        layout.levels.push_back({0, width, height, RP_NONE});
        image.levels++;
        if (width == 1 && height == 1) break;
    }
    layout.images.push_back(image);
}

std::span<rp_image_level> levels_of(const rp_image& image, ImageLayout& layout) {
    return std::span(layout.levels).subspan(image.first_level, image.levels);
}

void place_tail(const rp_image& image, ImageLayout& layout, TailPacker& packer) {
    uint32_t bytes = 0;
    for (const rp_image_level& level : levels_of(image, layout))
        if (!is_tiled(level.width, level.height)) bytes += tail_bytes(image.format, level.width, level.height);
    auto [page, at] = packer.place(bytes, layout.tails);
    for (rp_image_level& level : levels_of(image, layout)) {
        if (is_tiled(level.width, level.height)) continue;
        level.page = page;
        level.at = at;
        at += tail_bytes(image.format, level.width, level.height);
    }
}

}  // namespace

Status check_image_shape(const ImageShape& shape, const std::string& name) {
    if (shape.width == 0 || shape.height == 0)
        return Status::failed(fmt::format("{}: the image is empty ({} x {} texels)", name, shape.width, shape.height));
    if (shape.width > RP_IMAGE_MAX_SIZE || shape.height > RP_IMAGE_MAX_SIZE)
        return Status::failed(fmt::format("{}: the image has {} x {} texels; at most {} a side are accepted", name, shape.width, shape.height,
                                          uint32_t{RP_IMAGE_MAX_SIZE}));
    if (shape.channels != 1 && shape.channels != 4)
        return Status::failed(fmt::format("{}: the image has {} channels; it must have 1 or 4", name, shape.channels));
    if (shape.srgb && shape.kind != TexelKind::unsigned_8) return Status::failed(fmt::format("{}: the image is sRGB, but not of 8 bits", name));
    return {};
}

Result<ImageLayout> lay_out_images(std::span<const ImageShape> shapes) {
    ImageLayout layout;
    TailPacker packer;
    for (const ImageShape& shape : shapes) add_levels(shape, layout);
    for (const rp_image& image : layout.images) place_tail(image, layout, packer);
    uint64_t next = layout.tails.size();
    for (const rp_image& image : layout.images)
        for (rp_image_level& level : levels_of(image, layout)) {
            if (!is_tiled(level.width, level.height)) continue;
            level.page = static_cast<rp_u32>(next);
            next += tiles_of(image.format, level.width, level.height);
            if (next > max_pageables)
                return Status::failed(fmt::format("the images of the scene have more than {} pages of 64 KiB", uint32_t{max_pageables}));
        }
    layout.pages = static_cast<uint32_t>(next);
    return layout;
}

}  // namespace raypager
