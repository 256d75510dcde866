#include "clouds/point_spacing.hpp"

#include <algorithm>

namespace raypager {
namespace {

constexpr size_t enough = min_surface_points;  // that tell a spacing
constexpr size_t plenty = 64;                  // cells with more are divided

class Estimator {
public:
    Estimator(std::span<const CloudPoint> points, const PointOrder& order) : points_(points), order_(order), spacing_(points.size()) {}

    std::vector<float> run() {
        float whole = visit(0, order_.size(), point_grid_levels);
        if (whole == 0) whole = measure(0, order_.size());
        fill(0, order_.size(), whole > 0 ? whole : 1.0f);
        return std::move(spacing_);
    }

    float run_cell(int level, std::vector<float>& spacing) {
        const float whole = visit(0, order_.size(), level);
        spacing = std::move(spacing_);
        return whole;
    }

private:
    // The spacing of a cell, 0 if its points do not tell; gives it to those of its points that have none yet.
    float visit(size_t begin, size_t end, int level) {
        if (end - begin < enough) return 0;
        float spacing = 0;
        if (end - begin > plenty && level > 0) spacing = visit_children(begin, end, level);
        if (spacing == 0) spacing = measure(begin, end);
        fill(begin, end, spacing);
        return spacing;
    }

    // The median over the points of those children that tell.
    float visit_children(size_t begin, size_t end, int level) {
        std::vector<CellSpacing> children;
        for_each_child(order_, begin, end, level, [&](size_t first, size_t last) {
            const float spacing = visit(first, last, level - 1);
            children.push_back({spacing, last - first});
        });
        return divided_cell_spacing(std::move(children));
    }

    // Directly, from the points of a run, or of a sample of it where it is long (points in the same place).
    float measure(size_t begin, size_t end) {
        const size_t step = (end - begin + most_compared_points - 1) / most_compared_points;
        here_.clear();
        for (size_t i = begin; i < end; i += step) here_.push_back(points_[order_.indices[i]].position);
        return compared_spacing(here_);
    }

    void fill(size_t begin, size_t end, float spacing) {
        for (size_t i = begin; i < end; i++)
            if (float& own = spacing_[order_.indices[i]]; own == 0) own = spacing;
    }

    std::span<const CloudPoint> points_;
    const PointOrder& order_;
    std::vector<float> spacing_;
    std::vector<Float3> here_;
};

}  // namespace

float divided_cell_spacing(std::vector<CellSpacing> children) {
    std::erase_if(children, [](const CellSpacing& child) { return child.spacing == 0; });
    uint64_t points = 0, below = 0;
    for (const CellSpacing& child : children) points += child.points;
    std::sort(children.begin(), children.end(), [](const CellSpacing& a, const CellSpacing& b) { return a.spacing < b.spacing; });
    for (const CellSpacing& child : children)
        if (2 * (below += child.points) >= points) return child.spacing;
    return 0;
}

float estimate_cell_spacing(std::span<const CloudPoint> points, const PointOrder& order, int level, std::vector<float>& spacing) {
    return Estimator(points, order).run_cell(level, spacing);
}

std::vector<float> estimate_point_spacing(std::span<const CloudPoint> points, const PointOrder& order) {
    if (points.empty()) return {};
    return Estimator(points, order).run();
}

}  // namespace raypager
