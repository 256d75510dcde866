#include "procedural/warped_grid.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

constexpr uint64_t file_triangles = 500'000;

// Rows begin .. end of vertices, both included.
TriangleMesh band_of(const GridMesh& grid, size_t begin, size_t end) {
    const size_t columns = grid.x.size(), rows = grid.z.size();
    const size_t first = begin > 0 ? begin - 1 : begin, last = std::min(end + 1, rows - 1);  // those that normals look at
    std::vector<double> heights((last - first + 1) * columns);
    parallel_for(last - first + 1, 4, [&](size_t from, size_t to) {
        for (size_t r = from; r < to; r++)
            for (size_t c = 0; c < columns; c++) heights[r * columns + c] = grid.height(c, first + r);
    });
    TriangleMesh band;
    for (size_t r = begin; r <= end; r++)
        for (size_t c = 0; c < columns; c++) {
            const size_t left = c > 0 ? c - 1 : c, right = std::min(c + 1, columns - 1), above = r > first ? r - 1 : r, below = std::min(r + 1, last);
            const auto at = [&](size_t column, size_t row) { return heights[(row - first) * columns + column]; };
            const double slope_x = (at(right, r) - at(left, r)) / (grid.x[right] - grid.x[left]);
            const double slope_z = (at(c, below) - at(c, above)) / (grid.z[below] - grid.z[above]);
            band.positions.push_back(float3(Vector{grid.x[c], at(c, r), grid.z[r]} - grid.origin));
            band.normals.push_back(float3(unit({-slope_x, 1, -slope_z})));
            band.uvs.push_back({static_cast<float>(static_cast<double>(c) / static_cast<double>(columns - 1)),
                                static_cast<float>(static_cast<double>(r) / static_cast<double>(rows - 1))});
        }
    for (size_t r = 0; r < end - begin; r++)
        for (size_t c = 0; c + 1 < columns; c++) {
            const auto a = static_cast<uint32_t>(r * columns + c), d = static_cast<uint32_t>(a + columns);
            band.triangles.push_back({a, d, a + 1});
            band.triangles.push_back({a + 1, d, d + 1});
        }
    return band;
}

}  // namespace

double WarpedAxis::at(double t) const {
    const double middle = (focus - low) / (high - low);
    const auto bent = [&](double w) { return w * (tightness + (1 - tightness) * w * w); };
    return t < middle ? focus - (focus - low) * bent((middle - t) / middle) : focus + (high - focus) * bent((t - middle) / (1 - middle));
}

double WarpedAxis::inverse(double place) const {
    double from = 0, to = 1;
    for (int i = 0; i < 48; i++) {
        const double t = 0.5 * (from + to);
        (at(t) < place ? from : to) = t;
    }
    return 0.5 * (from + to);
}

std::vector<double> WarpedAxis::lines(uint64_t steps) const {
    std::vector<double> places(steps + 1);
    for (uint64_t i = 0; i <= steps; i++) places[i] = at(static_cast<double>(i) / static_cast<double>(steps));
    return places;
}

Status write_grid_mesh(SceneWriter& scene, std::string_view name, std::string_view material, const GridMesh& grid) {
    RAYPAGER_CHECK(grid.x.size() >= 2 && grid.z.size() >= 2);
    const size_t rows = grid.z.size() - 1;
    const uint64_t triangles = 2 * uint64_t{rows} * (grid.x.size() - 1);
    const size_t bands = static_cast<size_t>(std::min<uint64_t>(rows, triangles / file_triangles + 1));
    for (size_t i = 0; i < bands; i++)
        RAYPAGER_TRY(scene.textured_mesh(fmt::format("{}-{:03}", name, i), material, band_of(grid, rows * i / bands, rows * (i + 1) / bands)));
    return {};
}

}  // namespace raypager
