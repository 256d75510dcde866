#include "film/add_films.hpp"

#include "base/check.hpp"

namespace raypager {

FilmAdder::FilmAdder(const FilmLayout& layout) : words_(layout.words(), Word::kept) {
    const auto sums = [this](uint32_t first, uint32_t count) {
        for (uint32_t i = 0; i < count; i++) {
            words_[first + 2 * i] = Word::low;
            words_[first + 2 * i + 1] = Word::high;
        }
    };
    sums(0, 3);
    words_[RP_FILM_COUNT] = words_[RP_FILM_CLAMPED] =
        Word::number;  // its halves never overflow: all devices together begin no more samples than one may
    const FilmLayers& layers = layout.layers();
    if (layers.has(FilmLayer::albedo)) sums(layout.first(FilmLayer::albedo), 3);
    if (layers.has(FilmLayer::normal)) {
        sums(layout.first(FilmLayer::normal), 3);
        words_[layout.first(FilmLayer::normal) + RP_NORMAL_LAYER_COUNT] = Word::number;
    }
    if (layers.has(FilmLayer::variance)) sums(layout.first(FilmLayer::variance), 1);
    if (layers.has(FilmLayer::waits)) words_[layout.first(FilmLayer::waits)] = Word::number;
}

void FilmAdder::add(std::span<uint32_t> to, std::span<const uint32_t> from) const {
    RAYPAGER_CHECK(to.size() == from.size() && to.size() % words_.size() == 0);
    for (size_t pixel = 0; pixel < to.size(); pixel += words_.size()) {
        uint32_t carry = 0;
        for (size_t i = 0; i < words_.size(); i++) {
            uint32_t& word = to[pixel + i];
            const uint32_t other = from[pixel + i];
            // Devices of other kinds may disagree in the last bits: then one of them is right.
            if (words_[i] == Word::kept) {
                if (other != 0) word = other;
                continue;
            }
            const uint32_t before = word;
            word += other + (words_[i] == Word::high ? carry : 0);
            carry = words_[i] == Word::low && word < before ? 1 : 0;
        }
    }
}

}  // namespace raypager
