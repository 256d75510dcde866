#include "store/check_images.hpp"

#include <fmt/format.h>

#include "scene/check_texture.hpp"
#include "scene/image_levels.hpp"
#include "store/format.hpp"
#include "store/section_status.hpp"

namespace raypager {
namespace {

Status check_level(const BakedScene& scene, const rp_image& image, size_t index) {
    const rp_image_level& level = scene.image_levels[index];
    const auto bad = [index](const char* what) { return bad_section(format::image_levels, fmt::format("level {} {}", index, what)); };
    if (is_tiled(level.width, level.height)) {
        if (level.at != RP_NONE) return bad("must be in tiles");
        const uint64_t tiles = tiles_of(image.format, level.width, level.height);
        return level.page < scene.pages.size() && tiles <= scene.pages.size() - level.page ? Status() : bad("has tiles in pages that do not exist");
    }
    const uint32_t bytes = level.width * level.height * texel_bytes(image.format);
    if (level.page >= scene.pages.size() || level.at % 8 != 0 || level.at > RP_TEXTURE_PAGE_BYTES || bytes > RP_TEXTURE_PAGE_BYTES - level.at)
        return bad("does not lie within a page");
    return {};
}

// Each level has half of the texels of the one before it, down to one.
Status check_levels(const BakedScene& scene, const rp_image& image) {
    const auto bad = [](size_t index, const char* what) { return bad_section(format::image_levels, fmt::format("level {} {}", index, what)); };
    for (size_t i = 0; i < image.levels; i++) {
        const size_t index = image.first_level + i;
        const rp_image_level& level = scene.image_levels[index];
        if (level.width == 0 || level.height == 0 || level.width > RP_IMAGE_MAX_SIZE || level.height > RP_IMAGE_MAX_SIZE)
            return bad(index, "has an impossible size");
        if (i > 0) {
            const rp_image_level& before = scene.image_levels[index - 1];
            if (level.width != next_level_size(before.width) || level.height != next_level_size(before.height))
                return bad(index, "is not half as large as the one before it");
        }
        const bool single = level.width == 1 && level.height == 1;
        if (single != (i + 1 == image.levels)) return bad(index, single ? "must be the last of its image" : "cannot be the last of its image");
        RAYPAGER_TRY(check_level(scene, image, index));
    }
    return {};
}

Status check_pages(const BakedScene& scene, uint64_t file_bytes) {
    if (scene.blocks.size() > max_pageables || scene.pages.size() > max_pageables - scene.blocks.size())
        return bad_section(format::pages, "there are too many");
    for (size_t i = 0; i < scene.pages.size(); i++) {
        const uint64_t offset = scene.pages[i].offset;
        if (offset % format::page != 0 || offset < format::page || offset > file_bytes || RP_TEXTURE_PAGE_BYTES > file_bytes - offset)
            return bad_section(format::pages, fmt::format("page {} does not lie within the file", i));
    }
    return {};
}

}  // namespace

Status check_programs(const BakedScene& scene) {
    return check_textures({scene.texture_ops, scene.texture_maps, scene.materials, scene.images.size(),
                           [&scene](uint32_t image) { return texel_words(scene.images[image].format); }});
}

Status check_images(const BakedScene& scene, uint64_t file_bytes) {
    RAYPAGER_TRY(check_pages(scene, file_bytes));
    uint64_t levels = 0;
    for (size_t i = 0; i < scene.images.size(); i++) {
        const rp_image& image = scene.images[i];
        const auto bad = [i](const char* what) { return bad_section(format::images, fmt::format("image {} {}", i, what)); };
        if (image.format >= RP_TEXEL_FORMATS) return bad("has texels of an unknown format");
        if (image.srgb > 1 || (image.srgb && image.format != RP_TEXEL_GRAY8 && image.format != RP_TEXEL_RGBA8)) return bad("cannot be sRGB");
        if (image.levels == 0 || image.levels > RP_IMAGE_MAX_LEVELS || image.first_level != levels ||
            image.levels > scene.image_levels.size() - levels)
            return bad("has no levels");
        levels += image.levels;
        RAYPAGER_TRY(check_levels(scene, image));
    }
    if (levels != scene.image_levels.size()) return bad_section(format::image_levels, "there are more than the images have");
    const Status programs = check_programs(scene);
    return programs.ok() ? programs : bad_section(format::texture_ops, programs.message());
}

}  // namespace raypager
