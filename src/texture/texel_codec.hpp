// Texels as they are stored, and as numbers that can be averaged: linear, of what unit ever.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "raypager/abi/texture.h"

namespace raypager {

struct TexelCodec {
    uint32_t channels;
    // A row of so many texels. encode rounds to the nearest.
    void (*decode)(const std::byte* texels, size_t count, float* values);
    void (*encode)(const float* values, size_t count, std::byte* texels);
};
TexelCodec texel_codec(uint32_t format, bool srgb);

// What the 256 codes of sRGB stand for.
const std::array<float, 256>& linear_of_srgb();

}  // namespace raypager
