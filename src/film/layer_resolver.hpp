// From the words of a film's pixels (abi/film.h) to images of its layers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/hash.hpp"
#include "film/film_layout.hpp"
#include "raypager/film_layers.hpp"

namespace raypager {

class LayerResolver {
public:
    LayerResolver(uint32_t width, uint32_t height, const FilmLayout& layout);
    const FilmLayout& layout() const { return layout_; }
    // One pixel after the other. words: all of it, light included; samples: finished ones.
    void add(std::span<const uint32_t> words, uint32_t samples);
    std::vector<FilmLayerImage> take() { return std::move(images_); }
    uint64_t hash() const;

private:
    FilmLayout layout_;
    std::vector<FilmLayerImage> images_;
    std::vector<uint32_t> hashed_;  // of a pixel
    Hash64Stream hash_;
};

}  // namespace raypager
