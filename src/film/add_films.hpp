// The film of a render whose samples went to several devices is the sum of theirs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "film/film_layout.hpp"

namespace raypager {

class FilmAdder {
public:
    explicit FilmAdder(const FilmLayout& layout);
    // Adds whole pixels of a film to those of another. No sample is in both; what the film keeps of a pixel's first sample may be.
    void add(std::span<uint32_t> to, std::span<const uint32_t> from) const;

private:
    enum class Word : uint8_t { low, high, number, kept };  // of a sum of 64 bits; of a sum of 32; the same whoever writes it
    std::vector<Word> words_;                               // of a pixel
};

}  // namespace raypager
