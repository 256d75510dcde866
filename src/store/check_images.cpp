#include "store/check_images.hpp"

#include <fmt/format.h>

#include "lights/image_words.hpp"
#include "scene/check_texture.hpp"
#include "scene/image_levels.hpp"
#include "scene/light_images.hpp"
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

// What is said of a sky in pages is so of its image.
Status check_sky(const BakedScene& scene) {
    if (!scene.has_paged_sky()) return {};
    const auto bad = [](const char* what) { return bad_section(format::sky_words, what); };
    if (!are_sky_words(scene.sky_words)) return bad("directions cannot be drawn by them");
    const auto word = [&](uint32_t at) { return scene.sky_words[at]; };
    if (scene.images.empty() || word(RP_IMAGE_IN_PAGES) != scene.images.size() - 1) return bad("its image is not the last one");
    const rp_image& image = scene.images.back();
    const rp_image_level& whole = scene.image_levels[image.first_level];
    const LightImage& sky = *scene.light_images[*sky_image(scene.lights)];
    for (const uint32_t size : {word(RP_IMAGE_WIDTH), word(RP_IMAGE_HEIGHT), whole.width, whole.height})
        if (size != sky.width) return bad("its image has another size");
    if (word(RP_IMAGE_LEVEL) >= image.levels) return bad("it has no such level");
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

// The image of a sky in pages is the last one, and for programs there is none.
Status check_programs(const BakedScene& scene) {
    const size_t images = scene.images.size() - (!scene.images.empty() && scene.images.back().format == RP_TEXEL_SKY ? 1 : 0);
    return check_textures({scene.texture_ops, scene.texture_maps, scene.materials, images,
                           [&scene](uint32_t image) { return texel_words(scene.images[image].format); }});
}

Status check_images(const BakedScene& scene, uint64_t file_bytes) {
    RAYPAGER_TRY(check_pages(scene, file_bytes));
    uint64_t levels = 0;
    for (size_t i = 0; i < scene.images.size(); i++) {
        const rp_image& image = scene.images[i];
        const auto bad = [i](const char* what) { return bad_section(format::images, fmt::format("image {} {}", i, what)); };
        const bool of_sky = scene.has_paged_sky() && i + 1 == scene.images.size();
        if (of_sky ? image.format != RP_TEXEL_SKY : image.format >= RP_TEXEL_FORMATS) return bad("has texels of an unknown format");
        if (image.srgb > 1 || (image.srgb && image.format != RP_TEXEL_GRAY8 && image.format != RP_TEXEL_RGBA8)) return bad("cannot be sRGB");
        if (image.levels == 0 || image.levels > RP_IMAGE_MAX_LEVELS || image.first_level != levels ||
            image.levels > scene.image_levels.size() - levels)
            return bad("has no levels");
        levels += image.levels;
        RAYPAGER_TRY(check_levels(scene, image));
    }
    if (levels != scene.image_levels.size()) return bad_section(format::image_levels, "there are more than the images have");
    RAYPAGER_TRY(check_sky(scene));
    const Status programs = check_programs(scene);
    return programs.ok() ? programs : bad_section(format::texture_ops, programs.message());
}

}  // namespace raypager
