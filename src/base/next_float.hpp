// The floats beside a float, as std::nextafter has them, without a call: bounds are rounded outwards by the million.
#pragma once

#include <bit>
#include <cstdint>
#include <limits>

namespace raypager {

// The largest float below x; of minus infinity and of what is no number, the same.
inline float next_below(float x) {
    const auto bits = std::bit_cast<uint32_t>(x);
    if (x == 0) return -std::numeric_limits<float>::denorm_min();
    if (x > 0) return std::bit_cast<float>(bits - 1);
    return x >= std::numeric_limits<float>::lowest() ? std::bit_cast<float>(bits + 1) : x;
}
// The smallest float above x; likewise.
inline float next_above(float x) { return -next_below(-x); }

}  // namespace raypager
