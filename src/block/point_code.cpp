#include "block/point_code.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace raypager {
namespace {

// IEC 61966-2-1.
double linear_of_srgb(double value) { return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4); }

std::array<uint8_t, 256> make_color_table() {
    std::array<uint8_t, 256> table;
    for (int i = 0; i < 256; i++) table[i] = static_cast<uint8_t>(std::lround(255 * std::sqrt(linear_of_srgb(i / 255.0))));
    return table;
}

}  // namespace

float point_radius(uint32_t code) { return std::bit_cast<float>((code << RP_POINT_RADIUS_SHIFT) + RP_POINT_RADIUS_BIAS); }

uint32_t point_radius_code(float radius) {
    if (!(radius > RP_POINT_MIN_RADIUS)) return 0;
    if (!(radius < RP_POINT_LARGEST_RADIUS)) return RP_POINT_LARGEST_CODE;
    // Positive floats are ordered as their bits are.
    const uint32_t beyond = std::bit_cast<uint32_t>(radius) - RP_POINT_RADIUS_BIAS;
    return (beyond + (1u << RP_POINT_RADIUS_SHIFT) - 1) >> RP_POINT_RADIUS_SHIFT;
}

uint32_t point_color_code(uint32_t srgb) {
    static const std::array<uint8_t, 256> table = make_color_table();
    return uint32_t{table[srgb & 255u]} | uint32_t{table[srgb >> 8 & 255u]} << 8 | uint32_t{table[srgb >> 16 & 255u]} << 16;
}

std::array<float, 3> point_reflectance(uint32_t color_code) {
    std::array<float, 3> result;
    for (int k = 0; k < 3; k++) {
        const float root = static_cast<float>(color_code >> 8 * k & 255u) / 255.0f;
        result[k] = root * root;
    }
    return result;
}

}  // namespace raypager
