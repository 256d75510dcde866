// Floats by their numbers in order: what sorts them, or halves between them, as whole numbers.
#pragma once

#include <bit>
#include <cstdint>

namespace raypager {

// Smaller floats have smaller numbers, and neighbours follow each other; -0 comes just before 0.
inline uint32_t float_order(float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    return bits >> 31 ? ~bits : bits | 0x80000000u;
}
inline float float_at(uint32_t order) { return std::bit_cast<float>(order >> 31 ? order & 0x7fffffffu : ~order); }

}  // namespace raypager
