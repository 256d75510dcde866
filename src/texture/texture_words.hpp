// What textures are for kernels, beside the pages of their images: one run of words.
#pragma once

#include <cstdint>
#include <vector>

#include "block/baked_scene.hpp"

namespace raypager {

// First the 256 floats that the codes of sRGB stand for; then rp_image[], rp_image_level[], rp_texture_op[] and rp_texture_map[], each from a
// multiple of 16 bytes on: the words at which they begin.
struct TextureWords {
    uint32_t images_at = 0, levels_at = 0, ops_at = 0, maps_at = 0;
    std::vector<uint32_t> words;
};
TextureWords texture_words(const BakedScene& scene);

// Of these words; 0 where the scene has no programs, and nobody needs them.
uint64_t texture_words_bytes(const BakedScene& scene);

}  // namespace raypager
