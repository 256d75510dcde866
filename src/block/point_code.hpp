// The word that a point of a coloured cloud has in a block (abi/block.h, rp_sphere): radius and colour in 32 bits.
#pragma once

#include <array>
#include <cstdint>

#include "raypager/abi/block.h"

namespace raypager {

// The radius that a code stands for.
float point_radius(uint32_t code);
// The code of the least radius that is not below this one, so that surfaces of touching points stay closed. What lies outside of what
// can be stored becomes the least or the largest code.
uint32_t point_radius_code(float radius);
inline bool point_radius_fits(float radius) { return radius >= RP_POINT_MIN_RADIUS && radius <= RP_POINT_LARGEST_RADIUS; }

// srgb: red | green << 8 | blue << 16, as in CloudPoint. The code has the same order of channels.
uint32_t point_color_code(uint32_t srgb);
// Linear reflectance of red, green and blue: what the kernels make of it.
std::array<float, 3> point_reflectance(uint32_t color_code);

inline uint32_t point_word(uint32_t radius_code, uint32_t color_code) { return radius_code | color_code << 8; }

}  // namespace raypager
