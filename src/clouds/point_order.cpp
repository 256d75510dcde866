#include "clouds/point_order.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"

namespace raypager {
namespace {

constexpr uint64_t largest_place = (uint64_t{1} << point_grid_levels) - 1;

// Bit i of a place goes to bit 3 i.
uint64_t spread(uint64_t place) {
    place = (place | place << 32) & 0x001f00000000ffffu;
    place = (place | place << 16) & 0x001f0000ff0000ffu;
    place = (place | place << 8) & 0x100f00f00f00f00fu;
    place = (place | place << 4) & 0x10c30c30c30c30c3u;
    return (place | place << 2) & 0x1249249249249249u;
}

uint64_t gather_bits(uint64_t key) {
    key &= 0x1249249249249249u;
    key = (key | key >> 2) & 0x10c30c30c30c30c3u;
    key = (key | key >> 4) & 0x100f00f00f00f00fu;
    key = (key | key >> 8) & 0x001f0000ff0000ffu;
    key = (key | key >> 16) & 0x001f00000000ffffu;
    return (key | key >> 32) & largest_place;
}

}  // namespace

double PointGrid::size(int level) const { return std::ldexp(cell, level); }

PointGrid make_point_grid(const Box& bounds) {
    PointGrid grid;
    if (bounds.empty()) return grid;
    double extent = 0, largest = 0;
    for (int a = 0; a < 3; a++) {
        extent = std::max(extent, double(bounds.upper[a]) - bounds.lower[a]);
        largest = std::max({largest, std::abs(double(bounds.lower[a])), std::abs(double(bounds.upper[a]))});
    }
    // Coordinates have 24 bits: cells below 2^-30 of the largest divide nothing, and would make places inexact.
    extent = std::max({extent, std::ldexp(largest, -30 + point_grid_levels), 1e-30});
    // Half of the root's size holds the extent, so that the root may begin at a multiple of that half.
    const double root = std::exp2(std::floor(std::log2(extent)) + 2);
    grid.cell = std::ldexp(root, -point_grid_levels);
    for (int a = 0; a < 3; a++) grid.lower[a] = std::floor(bounds.lower[a] / (root / 2)) * (root / 2);
    return grid;
}

uint64_t morton_key(const PointGrid& grid, const Float3& position) {
    const double p[3] = {position.x, position.y, position.z};
    uint64_t key = 0;
    for (int a = 0; a < 3; a++) {
        const double place = std::floor((p[a] - grid.lower[a]) / grid.cell);
        RAYPAGER_CHECK(place >= 0 && place <= static_cast<double>(largest_place));
        key |= spread(static_cast<uint64_t>(place)) << a;
    }
    return key;
}

Float3 cell_corner(const PointGrid& grid, uint64_t key, int level) {
    float corner[3];
    for (int a = 0; a < 3; a++) {
        const uint64_t cell = gather_bits(key >> a) >> level << level;
        corner[a] = static_cast<float>(grid.lower[a] + static_cast<double>(cell) * grid.cell);
    }
    return {corner[0], corner[1], corner[2]};
}

PointOrder make_point_order(std::span<const CloudPoint> points) {
    PointOrder order;
    Box bounds;
    for (const CloudPoint& point : points) bounds.grow(point.position);
    order.grid = make_point_grid(bounds);
    std::vector<std::pair<uint64_t, uint32_t>> sorted(points.size());
    for (size_t i = 0; i < points.size(); i++) sorted[i] = {morton_key(order.grid, points[i].position), static_cast<uint32_t>(i)};
    std::sort(sorted.begin(), sorted.end());
    order.keys.reserve(points.size());
    order.indices.reserve(points.size());
    for (const auto& [key, index] : sorted) {
        order.keys.push_back(key);
        order.indices.push_back(index);
    }
    return order;
}

}  // namespace raypager
