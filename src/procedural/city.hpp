// A made-up city to be scanned: hills, a river, streets in a grid, and on the lots between them houses, blocks and towers, trees and cars.
// Units are metres; x east, y north, z up. Everything stays within its cell of the street grid, so that whoever looks for what is
// somewhere needs to look into one cell.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "procedural/numeric.hpp"

namespace raypager {

using Rgb8 = std::array<uint8_t, 3>;  // sRGB

// ASPRS standard point classes.
enum PointClass : uint8_t { unclassified = 1, ground = 2, low_vegetation = 3, high_vegetation = 5, building = 6, water = 9, road = 11 };

// Upright walls on a rectangle, under a flat roof or a gable.
struct CityBox {
    double x0 = 0, x1 = 0, y0 = 0, y1 = 0, z0 = 0;
    double eaves = 0;  // height of the walls' upper edge
    double ridge = 0;  // of the ridge above it, along the longer side; 0: a flat roof
    Rgb8 wall = {}, roof = {};
    PointClass kind = building;
    bool windows = false;
};

// A crown, as an ellipsoid.
struct CityTree {
    double x, y, z;  // its middle
    double radius, half_height;
    Rgb8 color;
};

enum class CellUse : uint8_t { street, crossing, garden, paved, park };

struct CityCell {
    CellUse use = CellUse::street;
    uint32_t first_box = 0, box_count = 0, first_tree = 0, tree_count = 0;
    double top = 0;       // nothing in it is higher
    double near_top = 0;  // nor in the cells around it, as far as a slanting ray may come from
};

class City {
public:
    // A square from (0, 0) to (side, side). Takes memory in proportion to its area, a few bytes a square metre.
    City(double side, uint64_t seed);
    double side() const { return side_; }
    static constexpr double typical_height = 16;  // of the ground

    double ground_height(double x, double y) const;
    bool in_river(double x, double y) const { return has_river_ && river_distance(x, y) < river_half_width; }

    // The cell that holds (x, y); those outside of the city belong to its border.
    struct Bounds {
        double x0, x1, y0, y1;
    };
    uint32_t column(double x) const;
    uint32_t row(double y) const;
    uint32_t columns() const { return static_cast<uint32_t>(xs_.size() - 1); }
    uint32_t rows() const { return static_cast<uint32_t>(ys_.size() - 1); }
    const CityCell& cell(uint32_t column, uint32_t row) const { return cells_[size_t{row} * columns() + column]; }
    Bounds bounds(uint32_t column, uint32_t row) const { return {xs_[column], xs_[column + 1], ys_[row], ys_[row + 1]}; }
    std::span<const CityBox> boxes(const CityCell& cell) const { return std::span(boxes_).subspan(cell.first_box, cell.box_count); }
    std::span<const CityTree> trees(const CityCell& cell) const { return std::span(trees_).subspan(cell.first_tree, cell.tree_count); }

private:
    static constexpr double river_half_width = 24;
    double river_distance(double x, double y) const;
    double shape_ground(double x, double y) const;
    void build_cell(uint32_t column, uint32_t row);
    void find_tops();

    double side_;
    uint64_t seed_;
    bool has_river_;
    std::vector<double> xs_, ys_;  // borders of columns and rows
    std::vector<uint32_t> column_of_metre_, row_of_metre_;
    std::vector<float> ground_;  // heights on a square grid
    size_t ground_columns_ = 0;
    std::vector<double> river_;  // x of its middle at every metre of y
    std::vector<CityCell> cells_;
    std::vector<CityBox> boxes_;
    std::vector<CityTree> trees_;
};

}  // namespace raypager
