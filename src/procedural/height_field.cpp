#include "procedural/height_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

constexpr uint64_t tile_quads = 700;  // along a side; 700^2 quads are less than max_mesh_triangles / 2 triangles
static_assert(tile_quads * tile_quads * 2 <= max_mesh_triangles / 2);

// The part of a field with the quads column_begin .. column_end - 1, row_begin .. row_end - 1.
class Tile {
public:
    Tile(const HeightField& field, uint64_t column_begin, uint64_t column_end, uint64_t row_begin, uint64_t row_end);
    void classify(const GroundClassifier& classifier);
    Status write(SceneWriter& scene, const std::string& name, uint8_t kind, std::string_view material);

private:
    size_t quad_columns() const { return columns_ - 1; }
    size_t quad_rows() const { return rows_ - 1; }
    size_t vertex(size_t column, size_t row) const { return row * columns_ + column; }

    size_t columns_, rows_;  // of vertices
    std::vector<Float3> positions_;
    std::vector<uint8_t> kinds_;  // one a quad
};

Tile::Tile(const HeightField& field, uint64_t column_begin, uint64_t column_end, uint64_t row_begin, uint64_t row_end)
    : columns_(column_end - column_begin + 1), rows_(row_end - row_begin + 1), positions_(columns_ * rows_) {
    parallel_for(rows_, 8, [&](size_t begin, size_t end) {
        for (size_t r = begin; r < end; r++)
            for (size_t c = 0; c < columns_; c++) {
                const auto column = static_cast<double>(column_begin + c), row = static_cast<double>(row_begin + r);
                positions_[vertex(c, r)] = float3({column * field.spacing_x, field.height(column, row), row * field.spacing_z});
            }
    });
}

void Tile::classify(const GroundClassifier& classifier) {
    kinds_.resize(quad_columns() * quad_rows());
    parallel_for(quad_rows(), 8, [&](size_t begin, size_t end) {
        for (size_t r = begin; r < end; r++)
            for (size_t c = 0; c < quad_columns(); c++) {
                const Float3 &a = positions_[vertex(c, r)], &b = positions_[vertex(c + 1, r)], &d = positions_[vertex(c, r + 1)],
                             &e = positions_[vertex(c + 1, r + 1)];
                const double slope_x = ((b.y - a.y) + (e.y - d.y)) / (2.0 * (b.x - a.x));
                const double slope_z = ((d.y - a.y) + (e.y - b.y)) / (2.0 * (d.z - a.z));
                const double upness = 1 / std::sqrt(1 + slope_x * slope_x + slope_z * slope_z);
                kinds_[r * quad_columns() + c] = classifier(0.5 * (a.x + b.x), 0.25 * (a.y + b.y + d.y + e.y), 0.5 * (a.z + d.z), upness);
            }
    });
}

Status Tile::write(SceneWriter& scene, const std::string& name, uint8_t kind, std::string_view material) {
    std::vector<uint32_t> renumbered(positions_.size(), RP_NONE);
    std::vector<Float3> used;
    std::vector<Triangle> triangles;
    const auto use = [&](size_t column, size_t row) {
        uint32_t& number = renumbered[vertex(column, row)];
        if (number == RP_NONE) {
            number = static_cast<uint32_t>(used.size());
            used.push_back(positions_[vertex(column, row)]);
        }
        return number;
    };
    for (size_t r = 0; r < quad_rows(); r++)
        for (size_t c = 0; c < quad_columns(); c++) {
            if (kinds_[r * quad_columns() + c] != kind) continue;
            const uint32_t a = use(c, r), b = use(c + 1, r), d = use(c, r + 1), e = use(c + 1, r + 1);
            triangles.push_back({a, d, b});  // counter-clockwise seen from above
            triangles.push_back({b, d, e});
        }
    if (triangles.empty()) return {};
    return scene.mesh(name, material, used, triangles);
}

}  // namespace

Status write_height_field(SceneWriter& scene, const HeightField& field, const std::vector<std::string_view>& materials,
                          const GroundClassifier& classify) {
    RAYPAGER_CHECK(field.columns > 0 && field.rows > 0);
    const uint64_t across = (field.columns + tile_quads - 1) / tile_quads, down = (field.rows + tile_quads - 1) / tile_quads;
    for (uint64_t j = 0; j < down; j++)
        for (uint64_t i = 0; i < across; i++) {
            Tile tile(field, field.columns * i / across, field.columns * (i + 1) / across, field.rows * j / down, field.rows * (j + 1) / down);
            tile.classify(classify);
            for (size_t kind = 0; kind < materials.size(); kind++)
                RAYPAGER_TRY(
                    tile.write(scene, fmt::format("ground-{:03}-{:03}-{}", j, i, materials[kind]), static_cast<uint8_t>(kind), materials[kind]));
        }
    return {};
}

HeightRange height_range(const HeightField& field, int steps) {
    HeightRange range{INFINITY, -INFINITY};
    for (int row = 0; row <= steps; row++)
        for (int column = 0; column <= steps; column++) {
            const double y = field.height(static_cast<double>(field.columns) * column / steps, static_cast<double>(field.rows) * row / steps);
            range.low = std::min(range.low, y);
            range.high = std::max(range.high, y);
        }
    return range;
}

}  // namespace raypager
