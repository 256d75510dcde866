// The octree over a cloud on disk, down to cells that fit into memory.
#pragma once

#include <cstdint>
#include <vector>

#include "clouds/point_sort.hpp"
#include "clouds/point_spacing.hpp"
#include "clouds/point_view.hpp"

namespace raypager {

struct CloudCell {
    uint64_t begin, end;  // of the sorted points
    int level;
    uint32_t parent;           // RP_NONE: the root
    uint32_t pixel = RP_NONE;  // the cell, this one or one above, that is not a unit, no larger than a pixel, and the largest such
    bool is_unit = false;      // has no children here
    bool is_whole = true;      // all points of a cell of the octree; otherwise a piece of a cell of the finest level
    float spacing = 0;         // 0: its points do not tell
};

class CloudCells {
public:
    // Divides cells with more than `most` points. Parents come before their children. view: for pixels; null: there are none.
    static Result<CloudCells> create(const SortedPoints& points, uint64_t most, const PointView* view);
    std::vector<CloudCell>& cells() { return cells_; }
    // Once all whole units have their spacing: that of all others.
    Status find_spacing();
    // What a unit that has no spacing gets from the cells around it.
    float inherited_spacing(const CloudCell& unit) const;

private:
    explicit CloudCells(const SortedPoints& points) : points_(&points) {}
    Status divide(uint32_t cell, uint64_t most, const PointView* view);
    Result<float> compared(const CloudCell& cell) const;

    const SortedPoints* points_;
    std::vector<CloudCell> cells_;
    float whole_ = 1;  // of the cloud
};

}  // namespace raypager
