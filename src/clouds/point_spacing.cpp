#include "clouds/point_spacing.hpp"

#include <algorithm>
#include <array>

#include "base/huge_pages.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

constexpr size_t enough = min_surface_points;  // that tell a spacing
constexpr size_t plenty = 64;                  // cells with more are divided

// Clouds with more points are divided into cells with no more, which threads look at one by one.
constexpr size_t points_of_task = size_t{1} << 15;

// The points of a run of the order, or of a sample of it where it is long (points in the same place).
float measure(std::span<const CloudPoint> points, const PointOrder& order, size_t begin, size_t end, std::vector<Float3>& positions) {
    const size_t step = (end - begin + most_compared_points - 1) / most_compared_points;
    positions.clear();
    for (size_t i = begin; i < end; i += step) positions.push_back(points[order.indices[i]].position);
    return compared_spacing(positions);
}

// Looks at the points of a cell, and at nothing else.
class CellEstimator {
public:
    // spacing: of the points in their order.
    CellEstimator(std::span<const CloudPoint> points, const PointOrder& order, std::span<float> spacing)
        : points_(points), order_(order), spacing_(spacing) {}

    // The spacing of a cell, 0 if its points do not tell. Those of its points of which nothing in it tells get 0.
    float run(size_t begin, size_t end, int level) {
        const float spacing = visit(begin, end, level);
        settle(0, 0);
        return spacing;
    }

private:
    // Of a cell within.
    float visit(size_t begin, size_t end, int level) {
        const size_t first = open_.size();
        float spacing = 0;
        if (end - begin > plenty && level > 0)
            spacing = visit_children(begin, end, level);
        else
            open_.push_back({begin, end});
        if (end - begin < enough) return 0;
        if (spacing == 0) spacing = measure(points_, order_, begin, end, positions_);
        if (spacing > 0) settle(first, spacing);
        return spacing;
    }

    // The median over the points of those children that tell.
    float visit_children(size_t begin, size_t end, int level) {
        std::array<CellSpacing, 8> children;
        size_t count = 0;
        for_each_child(order_, begin, end, level, [&](size_t first, size_t last) {
            const float spacing = visit(first, last, level - 1);
            children[count++] = {spacing, last - first};
        });
        return divided_cell_spacing(std::span(children).first(count));
    }

    // What is open from the first so many on gets this spacing.
    void settle(size_t first, float spacing) {
        for (const Run& run : std::span(open_).subspan(first))
            std::fill(spacing_.begin() + static_cast<ptrdiff_t>(run.begin), spacing_.begin() + static_cast<ptrdiff_t>(run.end), spacing);
        open_.resize(first);
    }

    struct Run {
        size_t begin = 0, end = 0;
    };
    std::span<const CloudPoint> points_;
    const PointOrder& order_;
    std::span<float> spacing_;
    std::vector<Run> open_;  // points that have no spacing yet
    std::vector<Float3> positions_;
};

// A whole cloud, by all threads: first the cells that are tasks, each alone, then what follows from them for the cells above and their points.
class CloudEstimator {
public:
    CloudEstimator(std::span<const CloudPoint> points, const PointOrder& order) : points_(points), order_(order), by_place_(points.size()) {}

    std::vector<float> run() {
        divide();
        parallel_for(tasks_.size(), 1, [&](size_t task, size_t) {
            Cell& cell = cells_[tasks_[task]];
            cell.spacing = CellEstimator(points_, order_, by_place_).run(cell.begin, cell.end, cell.level);
        });
        combine();
        std::vector<float> spacing(points_.size());
        parallel_for(tasks_.size(), 1, [&](size_t task, size_t) {
            const Cell& cell = cells_[tasks_[task]];
            for (size_t i = cell.begin; i < cell.end; i++) spacing[order_.indices[i]] = by_place_[i] > 0 ? by_place_[i] : cell.spacing;
        });
        return spacing;
    }

private:
    struct Cell {
        size_t begin, end;
        int level;
        size_t parent;
        float spacing = 0;
        std::vector<CellSpacing> children = {};
    };

    // Parents come before their children.
    void divide() {
        cells_.push_back({0, order_.size(), point_grid_levels, 0});
        for (size_t i = 0; i < cells_.size(); i++) {
            const size_t begin = cells_[i].begin, end = cells_[i].end;
            const int level = cells_[i].level;
            if (end - begin <= points_of_task || level == 0)
                tasks_.push_back(i);
            else
                for_each_child(order_, begin, end, level, [&](size_t first, size_t last) { cells_.push_back({first, last, level - 1, i}); });
        }
    }

    // Cells that are divided get their spacing from those within; then those that have none the spacing of the next larger cell that has one.
    void combine() {
        std::vector<Float3> positions;
        size_t tasks = tasks_.size();
        for (size_t i = cells_.size(); i-- > 0;) {
            Cell& cell = cells_[i];
            if (tasks > 0 && tasks_[tasks - 1] == i) {
                tasks--;
            } else {
                cell.spacing = divided_cell_spacing(cell.children);
                if (cell.spacing == 0) cell.spacing = measure(points_, order_, cell.begin, cell.end, positions);
            }
            if (i > 0) cells_[cell.parent].children.push_back({cell.spacing, cell.end - cell.begin});
        }
        Cell& root = cells_[0];
        if (root.spacing == 0) root.spacing = measure(points_, order_, root.begin, root.end, positions);
        if (!(root.spacing > 0)) root.spacing = 1;
        for (Cell& cell : cells_)
            if (cell.spacing == 0) cell.spacing = cells_[cell.parent].spacing;
    }

    std::span<const CloudPoint> points_;
    const PointOrder& order_;
    UnwrittenVector<float> by_place_;
    std::vector<Cell> cells_;
    std::vector<size_t> tasks_;  // the cells that are not divided
};

}  // namespace

float divided_cell_spacing(std::span<CellSpacing> children) {
    std::sort(children.begin(), children.end(), [](const CellSpacing& a, const CellSpacing& b) { return a.spacing < b.spacing; });
    uint64_t points = 0, below = 0;
    for (const CellSpacing& child : children) points += child.spacing > 0 ? child.points : 0;
    for (const CellSpacing& child : children)
        if (child.spacing > 0 && 2 * (below += child.points) >= points) return child.spacing;
    return 0;
}

float estimate_cell_spacing(std::span<const CloudPoint> points, const PointOrder& order, int level, std::span<float> spacing) {
    return CellEstimator(points, order, spacing).run(0, order.size(), level);
}

std::vector<float> estimate_point_spacing(std::span<const CloudPoint> points, const PointOrder& order) {
    if (points.empty()) return {};
    return CloudEstimator(points, order).run();
}

}  // namespace raypager
