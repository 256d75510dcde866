#include "clouds/cloud_cells.hpp"

#include <algorithm>

namespace raypager {
namespace {

// The first place in [begin, end) whose key lies beyond that of the child cell that holds the key at begin.
Result<uint64_t> end_of_child(const SortedPoints& points, uint64_t begin, uint64_t end, int child_level) {
    const int shift = 3 * child_level;
    const auto first = points.key(begin);
    if (!first) return first.status();
    uint64_t inside = begin;
    while (inside + 1 < end) {
        const uint64_t middle = inside + (end - inside) / 2;
        const auto key = points.key(middle);
        if (!key) return key.status();
        if (*key >> shift == *first >> shift)
            inside = middle;
        else
            end = middle;
    }
    return inside + 1;
}

}  // namespace

Result<CloudCells> CloudCells::create(const SortedPoints& points, uint64_t most, const PointView* view) {
    CloudCells cells(points);
    cells.cells_.push_back({0, points.size(), point_grid_levels, RP_NONE});
    for (uint32_t i = 0; i < cells.cells_.size(); i++)
        if (auto status = cells.divide(i, most, view); !status.ok()) return status;
    return cells;
}

Status CloudCells::divide(uint32_t cell, uint64_t most, const PointView* view) {
    const auto [begin, end, level, parent, inherited_pixel, is_unit, is_whole, spacing] = cells_[cell];
    if (end - begin <= most) {
        cells_[cell].is_unit = true;
        return {};
    }
    uint32_t pixel = inherited_pixel;
    if (view && pixel == RP_NONE) {
        const auto key = points_->key(begin);
        if (!key) return key.status();
        if (view->is_in_pixel(cell_corner(points_->grid, *key, level), points_->grid.size(level))) pixel = cell;
    }
    cells_[cell].pixel = pixel;
    if (level == 0) {  // all in one place, as far as the octree can tell
        for (uint64_t at = begin; at < end; at += most) cells_.push_back({at, std::min(at + most, end), 0, cell, pixel, true, false});
        return {};
    }
    for (uint64_t at = begin; at < end;) {
        const auto next = end_of_child(*points_, at, end, level - 1);
        if (!next) return next.status();
        cells_.push_back({at, *next, level - 1, cell, pixel});
        at = *next;
    }
    return {};
}

Result<float> CloudCells::compared(const CloudCell& cell) const {
    const uint64_t step = (cell.end - cell.begin + most_compared_points - 1) / most_compared_points;
    std::vector<Float3> positions;
    for (uint64_t at = cell.begin; at < cell.end; at += step) {
        PointRecord record;
        if (auto status = points_->read(at, std::span(&record, 1)); !status.ok()) return status;
        positions.push_back(record.point.position);
    }
    return compared_spacing(positions);
}

Status CloudCells::find_spacing() {
    std::vector<std::vector<CellSpacing>> children(cells_.size());
    for (size_t i = cells_.size(); i-- > 0;) {
        CloudCell& cell = cells_[i];
        if (!cell.is_unit) {
            cell.spacing = divided_cell_spacing(children[i]);
            if (cell.spacing == 0) {
                const auto spacing = compared(cell);
                if (!spacing) return spacing.status();
                cell.spacing = *spacing;
            }
        }
        if (cell.parent != RP_NONE) children[cell.parent].push_back({cell.spacing, cell.end - cell.begin});
    }
    whole_ = cells_[0].spacing;
    if (whole_ == 0 && points_->size() > 0) {
        const auto spacing = compared(cells_[0]);
        if (!spacing) return spacing.status();
        whole_ = *spacing;
    }
    if (!(whole_ > 0)) whole_ = 1;
    return {};
}

float CloudCells::inherited_spacing(const CloudCell& unit) const {
    for (uint32_t cell = unit.parent; cell != RP_NONE; cell = cells_[cell].parent)
        if (cells_[cell].spacing > 0) return cells_[cell].spacing;
    return whole_;
}

}  // namespace raypager
