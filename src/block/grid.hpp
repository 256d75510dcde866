// The grid of 16-bit coordinates on which boxes of a block, or of the top tree, are stored (abi/block.h, "Quantised boxes").
#pragma once

#include "raypager/abi/block.h"
#include "scene/box4.hpp"

namespace raypager {

struct Grid {
    float origin[3] = {0, 0, 0};
    float cell[3] = {1, 1, 1};
};

// A grid that holds every box inside bounds, which must not be empty.
Grid make_grid(const Box& bounds);
// Rounds the box outwards by at least RP_GRID_SLACK cells; x, y, z of the result are set.
rp_child quantise(const Grid& grid, const Box& box, rp_u32 ref);
// The stored box, exactly but for one rounding in double precision: lower, upper for an axis. word: rp_child::x, y or z.
struct Interval {
    double lower, upper;
};
Interval decode_interval(const Grid& grid, int axis, rp_u32 word);

}  // namespace raypager
