// Where the words of a pixel of the film lie: its light first (raypager/abi/film.h), then those of its layers.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "raypager/abi/film.h"
#include "raypager/abi/scene.h"
#include "raypager/film_layers.hpp"

namespace raypager {

class FilmLayout {
public:
    explicit FilmLayout(const FilmLayers& layers = {}, bool adaptive = false);
    explicit FilmLayout(const rp_render_params& params) : FilmLayout(FilmLayers(params.film_layers), params.adaptive_error > 0) {}
    uint32_t words() const { return words_; }  // per pixel
    const FilmLayers& layers() const { return layers_; }
    bool adaptive() const { return adaptive_; }
    uint32_t adaptive_words() const { return RP_FILM_WORDS; }                                     // the first of them
    uint32_t layer_words() const { return RP_FILM_WORDS + (adaptive_ ? RP_ADAPTIVE_WORDS : 0); }  // likewise, of all layers
    // Of a layer that the film has words for, the first of them.
    uint32_t first(FilmLayer layer) const { return first_[static_cast<uint32_t>(layer)]; }
    // Whether kernels must keep the numbers of the instance of each hit, and of its object.
    bool needs_ids() const { return layers_.has(FilmLayer::object) || layers_.has(FilmLayer::instance); }
    // Whether a path must keep what its camera ray met.
    bool needs_first_hits() const { return layers_.has(FilmLayer::albedo) || layers_.has(FilmLayer::normal); }
    // For kernels, each with a space behind it: RP_FILM_STRIDE, and RP_LAYER_... for each layer that the film has words for; without layers nothing.
    std::string definitions() const;

private:
    FilmLayers layers_;
    bool adaptive_ = false;
    uint32_t words_ = RP_FILM_WORDS;
    std::array<uint32_t, film_layer_count> first_{};
};

}  // namespace raypager
