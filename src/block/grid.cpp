#include "block/grid.hpp"

#include <cmath>

#include "base/check.hpp"

namespace raypager {
namespace {

// The cell must not be too small beside the coordinates, for two reasons. The origin is rounded to a float: that moves the grid by up
// to 2^-24 |origin|, which must stay within the margins; and a kernel's own roundings are of that size too. With an extent of at least
// 2^-10 of the largest coordinate, the origin moves by no more than 2^-14 of the extent, 2 cells of RP_GRID_SPAN, and a step of the
// grid, half a cell, is still a quarter of the distance between neighbouring floats, so that boxes lose nothing.
constexpr double min_extent_of_coordinate = 0x1p-10;
// For a ray that runs along a plane, 1 / direction is capped at 1e18 (kernels/common/arithmetic.cl): a flat box must still be so thick that
// the slack times that lies beyond any distance in the scene. 2^-16 of the largest coordinate on any axis gives 3e7 times that.
constexpr double min_extent_of_any_coordinate = 0x1p-16;
// A primitive can be hit a little beside its own bounds, by roundings that grow with its length (kernels/common/box.cl): the slack on the thin axes
// of a rod must cover those of its long one. A step of the grid is still 2e-6 of that.
constexpr double min_extent_of_longest = 0x1p-3;
constexpr double min_extent = 1e-28;  // keeps cells and their products with directions normal numbers

// Beyond RP_GRID_SLACK, for the roundings of the double arithmetic here.
constexpr double own_slack = RP_GRID_SLACK + 1e-6;

uint32_t round_down(double x) {
    RAYPAGER_CHECK(x >= RP_GRID_MIN && x <= RP_GRID_MAX);
    return static_cast<uint32_t>(2 * (x - RP_GRID_MIN));
}

uint32_t round_up(double x) {
    RAYPAGER_CHECK(x >= RP_GRID_MIN && x <= RP_GRID_MAX);
    const double step = 2 * (x - RP_GRID_MIN);
    const auto below = static_cast<uint32_t>(step);
    return below + (below < step);
}

}  // namespace

Grid make_grid(const Box& bounds) {
    RAYPAGER_CHECK(!bounds.empty());
    Grid grid;
    double any_coordinate = 0, longest = 0;
    for (int a = 0; a < 3; a++) {
        any_coordinate = std::max({any_coordinate, std::abs(double(bounds.lower[a])), std::abs(double(bounds.upper[a]))});
        longest = std::max(longest, double(bounds.upper[a]) - double(bounds.lower[a]));
    }
    for (int a = 0; a < 3; a++) {
        const double lower = bounds.lower[a], upper = bounds.upper[a];
        const double coordinate = std::max(std::abs(lower), std::abs(upper));
        const double extent = std::max({upper - lower, longest * min_extent_of_longest, coordinate * min_extent_of_coordinate,
                                        any_coordinate * min_extent_of_any_coordinate, min_extent});
        grid.cell[a] = static_cast<float>(extent / RP_GRID_SPAN);
        grid.origin[a] = static_cast<float>(lower - (RP_GRID_MIN + RP_GRID_MARGIN) * double(grid.cell[a]));
    }
    return grid;
}

Interval decode_interval(const Grid& grid, int axis, rp_u32 word) {
    const double origin = grid.origin[axis], cell = grid.cell[axis];
    return {origin + cell * RP_GRID_VALUE(word & 0xffffu), origin + cell * RP_GRID_VALUE(word >> 16)};
}

rp_child quantise(const Grid& grid, const Box& box, rp_u32 ref) {
    rp_u32 words[3];
    for (int a = 0; a < 3; a++) {
        const double origin = grid.origin[a], cell = grid.cell[a];
        const double cells = 1 / cell;
        const uint32_t lower = round_down((double(box.lower[a]) - origin) * cells - own_slack);
        const uint32_t upper = round_up((double(box.upper[a]) - origin) * cells + own_slack);
        words[a] = lower | upper << 16;
        const Interval decoded = decode_interval(grid, a, words[a]);
        RAYPAGER_CHECK(decoded.lower <= box.lower[a] - RP_GRID_SLACK * cell && decoded.upper >= box.upper[a] + RP_GRID_SLACK * cell);
    }
    return {words[0], words[1], words[2], ref};
}

}  // namespace raypager
