// What follows from the size of an image and the format of its texels (abi/texture.h): its levels, and how they are cut.
#pragma once

#include <algorithm>
#include <cstdint>

#include "raypager/abi/texture.h"
#include "raypager/scene.hpp"

namespace raypager {

inline uint32_t format_of(const ImageShape& shape) {
    const uint32_t kind = shape.kind == TexelKind::unsigned_8 ? 0 : shape.kind == TexelKind::unsigned_16 ? 1 : 2;
    return (shape.channels == 1 ? RP_TEXEL_GRAY8 : RP_TEXEL_RGBA8) + kind;
}

constexpr uint32_t texel_bytes(uint32_t format) { return 1u << RP_TEXEL_LOG_BYTES(format); }

// Of a path slot, that keep a texel.
constexpr uint32_t texel_words(uint32_t format) { return texel_bytes(format) > sizeof(rp_u32) ? 2 : 1; }

struct TileShape {
    uint32_t log_width, log_height;
    uint32_t width() const { return 1u << log_width; }
    uint32_t height() const { return 1u << log_height; }
    uint64_t across(uint32_t texels) const { return (uint64_t{texels} + width() - 1) >> log_width; }
    uint64_t down(uint32_t texels) const { return (uint64_t{texels} + height() - 1) >> log_height; }
};

constexpr TileShape tile_shape(uint32_t format) {
    const uint32_t log_bytes = RP_TEXEL_LOG_BYTES(format);
    return {RP_TILE_LOG_WIDTH(log_bytes), RP_TILE_LOG_HEIGHT(log_bytes)};
}

constexpr bool is_tiled(uint32_t width, uint32_t height) { return std::max(width, height) > RP_IMAGE_TAIL_SIZE; }

inline uint64_t tiles_of(uint32_t format, uint32_t width, uint32_t height) {
    const TileShape tile = tile_shape(format);
    return tile.across(width) * tile.down(height);
}

constexpr uint32_t next_level_size(uint32_t texels) { return texels / 2 + texels % 2; }

// What a level of the tail takes of its page: the next one begins at a multiple of 8.
constexpr uint32_t tail_bytes(uint32_t format, uint32_t width, uint32_t height) { return (width * height * texel_bytes(format) + 7) / 8 * 8; }

}  // namespace raypager
