#include "texture/texture_words.hpp"

#include <cstring>

#include "texture/texel_codec.hpp"

namespace raypager {
namespace {

constexpr size_t words_of_16_bytes = 4;

template <class Items>
uint64_t words_of(const Items& items) {
    const uint64_t words = items.size() * sizeof(items[0]) / sizeof(uint32_t);
    return (words + words_of_16_bytes - 1) / words_of_16_bytes * words_of_16_bytes;
}

template <class Items>
uint32_t append(const Items& items, std::vector<uint32_t>& words) {
    const size_t at = words.size();
    words.resize(at + words_of(items));
    if (!items.empty()) std::memcpy(words.data() + at, items.data(), items.size() * sizeof(items[0]));
    return static_cast<uint32_t>(at);
}

}  // namespace

uint64_t texture_words_bytes(const BakedScene& scene) {
    if (!scene.has_textures()) return 0;
    return (words_of(linear_of_srgb()) + words_of(scene.images) + words_of(scene.image_levels) + words_of(scene.texture_ops) +
            words_of(scene.texture_maps)) *
           sizeof(uint32_t);
}

TextureWords texture_words(const BakedScene& scene) {
    TextureWords result;
    append(linear_of_srgb(), result.words);
    result.images_at = append(scene.images, result.words);
    result.levels_at = append(scene.image_levels, result.words);
    result.ops_at = append(scene.texture_ops, result.words);
    result.maps_at = append(scene.texture_maps, result.words);
    return result;
}

}  // namespace raypager
