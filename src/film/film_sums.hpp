// The sums in a pixel of the film, as numbers (raypager/abi/film.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "raypager/abi/film.h"

namespace raypager {

// In units of 2^-RP_FILM_SCALE_BITS. first: the first of its two words.
inline uint64_t film_units(std::span<const uint32_t> pixel, size_t first) { return pixel[first] | uint64_t{pixel[first + 1]} << 32; }

inline double film_sum(std::span<const uint32_t> pixel, size_t first) {
    return static_cast<double>(film_units(pixel, first)) * (1.0 / (uint64_t{1} << RP_FILM_SCALE_BITS));
}

// Of the light of all finished samples.
inline double luminance_sum(std::span<const uint32_t> pixel) {
    return 0.2126729 * film_sum(pixel, 0) + 0.7151522 * film_sum(pixel, 2) + 0.0721750 * film_sum(pixel, 4);
}

}  // namespace raypager
