// Which coordinates and boxes a block file may hold. Bakers stay well within (world/placement.hpp, grid.cpp); with more, the boxes of the wide form,
// and distances, would not be finite.
#pragma once

#include <cmath>

#include "block/grid.hpp"

namespace raypager {

inline constexpr float largest_stored_coordinate = 1e13f;
// Also false of what is no number.
inline bool is_stored_coordinate(float x) { return std::abs(x) <= largest_stored_coordinate; }

// All planes of a grid, and its cells: products with directions stay normal numbers.
inline bool is_stored_grid(const float (&origin)[3], const float (&cell)[3]) {
    bool good = true;
    for (int axis = 0; axis < 3; axis++) good = good && std::abs(origin[axis]) <= 1e14f && cell[axis] >= 1e-33f && cell[axis] <= 1e9f;
    return good;
}

// Whether the box ends nowhere before it begins.
inline bool is_stored_box(const rp_child& child) {
    const auto in_order = [](rp_u32 word) { return (word & 0xffffu) <= word >> 16; };
    return in_order(child.x) && in_order(child.y) && in_order(child.z);
}

}  // namespace raypager
