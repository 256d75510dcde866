// The points of a cloud in Morton order, which is that of an octree's leaves: every cell of the octree is a run of them.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "base/huge_pages.hpp"
#include "raypager/scene.hpp"
#include "scene/box4.hpp"

namespace raypager {

// A cube of 2^21 cells on each axis. Its cells have a power of two as their size and lie at multiples of it, and so do those of every
// coarser level below the root: a cell of the octree does not depend on what else is in the cloud.
struct PointGrid {
    double lower[3] = {0, 0, 0};
    double cell = 1;
    double size(int level) const;  // of a cell of the octree; level 0: the finest
};
inline constexpr int point_grid_levels = 21;  // level of the root

PointGrid make_point_grid(const Box& bounds);
// The bits of the cell's place on each axis, interleaved: x lowest.
uint64_t morton_key(const PointGrid& grid, const Float3& position);

// Lower corner of the octree's cell of this level that holds the key.
Float3 cell_corner(const PointGrid& grid, uint64_t key, int level);

// What points are sorted by: their key, then their index.
struct PointKey {
    uint64_t key;
    uint32_t index;
    auto operator<=>(const PointKey&) const = default;
};

struct PointOrder {
    PointGrid grid;
    UnwrittenVector<uint64_t> keys;     // ascending
    UnwrittenVector<uint32_t> indices;  // of the points, in the order of PointKey

    size_t size() const { return keys.size(); }
};

// By all threads. REQUIRES: fewer than 2^32 points, all finite.
PointOrder make_point_order(std::span<const CloudPoint> points);

// Calls visit(begin, end) for each child, in order, of the cell of this level (at least 1) that is the run [begin, end).
template <class Visit>
void for_each_child(const PointOrder& order, size_t begin, size_t end, int level, Visit&& visit) {
    const int shift = 3 * (level - 1);
    while (begin < end) {
        const auto first = order.keys.begin();
        const auto next = std::partition_point(first + static_cast<ptrdiff_t>(begin), first + static_cast<ptrdiff_t>(end),
                                               [child = order.keys[begin] >> shift, shift](uint64_t key) { return key >> shift == child; });
        const auto middle = static_cast<size_t>(next - first);
        visit(begin, middle);
        begin = middle;
    }
}

}  // namespace raypager
