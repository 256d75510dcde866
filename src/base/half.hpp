// Numbers of 16 bits: IEEE 754 binary16.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace raypager {

inline constexpr float largest_half = 65504;
inline constexpr uint16_t infinite_half = 0x7c00;

// The nearest; those beyond the largest become that. REQUIRES: not NaN.
inline uint16_t half_of(float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    const auto sign = static_cast<uint16_t>(bits >> 16 & 0x8000u);
    const uint32_t magnitude = std::min(bits & 0x7fffffffu, std::bit_cast<uint32_t>(largest_half));
    constexpr uint32_t smallest_normal = 0x38800000u, rebias = 0x38000000u;
    // Beside 0.5 a float has the steps of the smallest halves.
    if (magnitude < smallest_normal)
        return static_cast<uint16_t>(sign | (std::bit_cast<uint32_t>(std::bit_cast<float>(magnitude) + 0.5f) - std::bit_cast<uint32_t>(0.5f)));
    return static_cast<uint16_t>(sign | ((magnitude + 0xfffu + (magnitude >> 13 & 1u) - rebias) >> 13));
}

// REQUIRES: finite.
inline float float_of_half(uint16_t half) {
    const float magnitude = std::bit_cast<float>((half & 0x7fffu) << 13) * 0x1p112f;
    return std::bit_cast<float>(std::bit_cast<uint32_t>(magnitude) | (half & 0x8000u) << 16);
}

inline bool is_finite_half(uint16_t half) { return (half & infinite_half) != infinite_half; }
inline bool is_nan_half(uint16_t half) { return (half & 0x7fffu) > infinite_half; }

// NaN as 0, infinity as the largest.
inline uint16_t finite_half(uint16_t half) {
    if (is_finite_half(half)) return half;
    return is_nan_half(half) ? uint16_t{0} : static_cast<uint16_t>((half & 0x8000u) | 0x7bffu);
}

}  // namespace raypager
