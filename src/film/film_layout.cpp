#include "film/film_layout.hpp"

#include <fmt/format.h>

namespace raypager {
namespace {

// Words of a pixel. Sums take two for each channel; the number of samples is in the film as it is.
constexpr std::array<uint32_t, film_layer_count> words_of_layer = {6, RP_NORMAL_LAYER_WORDS, 1, 3, 1, 1, 1, 0, 2, 1};
constexpr std::array<const char*, film_layer_count> layer_definitions = {
    "RP_LAYER_ALBEDO",   "RP_LAYER_NORMAL", "RP_LAYER_DEPTH", "RP_LAYER_POSITION", "RP_LAYER_OBJECT", "RP_LAYER_INSTANCE", "RP_LAYER_MATERIAL", "",
    "RP_LAYER_VARIANCE", "RP_LAYER_WAITS"};

}  // namespace

FilmLayout::FilmLayout(const FilmLayers& layers, bool adaptive) : layers_(layers), adaptive_(adaptive), words_(layer_words()) {
    for (uint32_t i = 0; i < film_layer_count; i++) {
        if (!layers.has(static_cast<FilmLayer>(i)) || words_of_layer[i] == 0) continue;
        first_[i] = words_;
        words_ += words_of_layer[i];
    }
}

std::string FilmLayout::definitions() const {
    if (words_ == RP_FILM_WORDS) return {};
    std::string result = fmt::format("-DRP_FILM_STRIDE={}u ", words_);
    if (needs_ids()) result += "-DRP_HIT_IDS ";
    if (needs_first_hits()) result += "-DRP_FIRST_HITS ";
    for (uint32_t i = 0; i < film_layer_count; i++) {
        if (first_[i] != 0) result += fmt::format("-D{}={}u ", layer_definitions[i], first_[i]);
    }
    return result;
}

}  // namespace raypager
