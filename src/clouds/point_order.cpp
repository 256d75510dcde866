#include "clouds/point_order.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "base/check.hpp"
#include "base/group_places.hpp"
#include "base/jitter.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

// What one thread does at a time; more where that would be too many pieces, each of which counts its points of each group.
constexpr size_t piece_points = size_t{1} << 14, most_pieces = 1024;
// So many points are sorted at once, or more where there would be too many groups: these are found on a sample.
constexpr size_t points_of_group = size_t{1} << 13, most_groups = 4096, sample_of_group = 16;

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

Box bounds_of(std::span<const CloudPoint> points) {
    Box bounds;
    std::mutex mutex;
    parallel_for(points.size(), piece_points, [&](size_t begin, size_t end) {
        Box part;
        for (const CloudPoint& point : points.subspan(begin, end - begin)) part.grow(point.position);
        const std::lock_guard lock(mutex);
        bounds.grow(part);
    });
    return bounds;
}

// The first key of each group but the first. Groups tell equal keys apart by index, so that points in one place are no group larger than others.
std::vector<PointKey> group_boundaries(std::span<const uint64_t> keys) {
    const size_t groups = std::min(keys.size() / points_of_group + 1, most_groups), sampled = std::min(keys.size(), groups * sample_of_group);
    std::vector<PointKey> sample, boundaries;
    for (size_t i = 0; i < sampled; i++) {
        const size_t at = one_of_stretch(i, sampled, keys.size());
        sample.push_back({keys[at], static_cast<uint32_t>(at)});
    }
    std::sort(sample.begin(), sample.end());
    for (size_t g = 1; g < groups; g++) boundaries.push_back(sample[sample.size() * g / groups]);
    return boundaries;
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
    const double cells_a_unit = 1 / grid.cell;  // a power of two: exact
    uint64_t key = 0;
    for (int a = 0; a < 3; a++) {
        const double place = (p[a] - grid.lower[a]) * cells_a_unit;
        RAYPAGER_CHECK(place >= 0 && place < static_cast<double>(largest_place + 1));
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
    order.grid = make_point_grid(bounds_of(points));
    order.keys.resize(points.size());
    order.indices.resize(points.size());
    parallel_for(points.size(), piece_points, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) order.keys[i] = morton_key(order.grid, points[i].position);
    });
    const std::vector<PointKey> boundaries = group_boundaries(order.keys);
    const auto key_of = [&](size_t i) { return PointKey{order.keys[i], static_cast<uint32_t>(i)}; };
    const size_t piece = std::max(piece_points, points.size() / most_pieces + 1);
    const GroupPlaces places(points.size(), boundaries.size() + 1, piece, [&](size_t i) {
        return static_cast<size_t>(std::upper_bound(boundaries.begin(), boundaries.end(), key_of(i)) - boundaries.begin());
    });
    UnwrittenVector<PointKey> sorted(points.size());
    places.put_all([&](size_t i, uint32_t place) { sorted[place] = key_of(i); });
    parallel_for(boundaries.size() + 1, 1, [&](size_t group, size_t) {
        const size_t begin = places.begin(group), end = places.begin(group + 1);
        std::sort(sorted.begin() + static_cast<ptrdiff_t>(begin), sorted.begin() + static_cast<ptrdiff_t>(end));
        for (size_t i = begin; i < end; i++) {
            order.keys[i] = sorted[i].key;
            order.indices[i] = sorted[i].index;
        }
    });
    return order;
}

}  // namespace raypager
