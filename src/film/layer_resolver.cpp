#include "film/layer_resolver.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "film/film_sums.hpp"
#include "raypager/abi/film.h"

namespace raypager {
namespace {

float float_of_id(uint32_t id) {
    constexpr uint32_t most = (1u << 24) - 1;
    return id == 0 ? 0.0f : static_cast<float>((id - 1) % most + 1);
}

// Of the mean luminance of independent samples.
float variance_of(std::span<const uint32_t> words, size_t first, uint32_t samples) {
    if (samples < 2) return 0;
    const double n = samples;
    const double mean = luminance_sum(words) / n;
    return static_cast<float>(std::max(0.0, film_sum(words, first) / n - mean * mean) / (n - 1));
}

void append_layer(FilmLayer layer, std::span<const uint32_t> words, size_t first, uint32_t samples, std::vector<float>& values) {
    const double n = std::max(samples, 1u);
    switch (layer) {
        case FilmLayer::albedo:
            for (size_t i = 0; i < 3; i++) values.push_back(static_cast<float>(film_sum(words, first + 2 * i) / n));
            break;
        case FilmLayer::normal:
            for (size_t i = 0; i < 3; i++)
                values.push_back(static_cast<float>((2 * film_sum(words, first + 2 * i) - words[first + RP_NORMAL_LAYER_COUNT]) / n));
            break;
        case FilmLayer::depth:
            values.push_back(words[first] == 0 ? std::numeric_limits<float>::infinity() : std::bit_cast<float>(words[first]));
            break;
        case FilmLayer::position:
            for (size_t i = 0; i < 3; i++) values.push_back(std::bit_cast<float>(words[first + i]));
            break;
        case FilmLayer::object:
        case FilmLayer::instance:
        case FilmLayer::material:
            values.push_back(float_of_id(words[first]));
            break;
        case FilmLayer::samples:
            values.push_back(static_cast<float>(samples));
            break;
        case FilmLayer::variance:
            values.push_back(variance_of(words, first, samples));
            break;
        case FilmLayer::waits:
            values.push_back(static_cast<float>(words[first]));
            break;
    }
}

}  // namespace

LayerResolver::LayerResolver(uint32_t width, uint32_t height, const FilmLayout& layout) : layout_(layout), hash_(layout.layers().bits()) {
    for (uint32_t i = 0; i < film_layer_count; i++) {
        const auto layer = static_cast<FilmLayer>(i);
        if (!layout.layers().has(layer)) continue;
        const auto channels = static_cast<uint32_t>(film_layer_channels(layer).size());
        images_.push_back({layer, {width, height, channels, {}}});
        images_.back().image.values.reserve(uint64_t{width} * height * channels);
    }
}

void LayerResolver::add(std::span<const uint32_t> words, uint32_t samples) {
    for (FilmLayerImage& image : images_) append_layer(image.layer, words, layout_.first(image.layer), samples, image.image.values);
    hashed_.assign(words.begin() + layout_.layer_words(), words.end());
    // The last layer of all.
    if (layout_.layers().has(FilmLayer::waits)) hashed_.pop_back();
    hash_.add(std::as_bytes(std::span(hashed_)));
}

uint64_t LayerResolver::hash() const { return layout_.layers().any() ? hash_.value() : 0; }

}  // namespace raypager
