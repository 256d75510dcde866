#include "procedural/city.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "procedural/noise.hpp"

namespace raypager {
namespace {

// The street grid: a street, then lots side by side.
constexpr double street_x = 16, lot_x = 24, street_y = 14, lot_y = 28;
constexpr uint32_t lots_x = 4, lots_y = 2;  // a block
constexpr uint32_t period_x = lots_x + 1, period_y = lots_y + 1;

// Heights of the ground are kept on a grid, and interpolated: the shortest waves in it are 120 metres.
constexpr double ground_spacing = 4, ground_margin = 60;
constexpr double river_level = -2;
constexpr double smallest_city_with_river = 450;
// Cells to each side from which a slanting ray may come: five of them are 112 m across at least, and a slope of 1 reaches as far as what
// stands there is high.
constexpr uint32_t neighbours = 5;
constexpr double tallest = 84;

constexpr Rgb8 facades[] = {{214, 203, 182}, {196, 178, 152}, {176, 120, 96}, {188, 188, 184}, {226, 216, 198}, {158, 142, 128}, {206, 172, 130}};
constexpr Rgb8 tiles[] = {{162, 84, 62}, {148, 72, 56}, {122, 66, 54}, {96, 88, 86}, {134, 92, 70}, {110, 76, 66}};
constexpr Rgb8 flat_roofs[] = {{142, 140, 136}, {168, 164, 156}, {116, 114, 112}, {186, 182, 174}, {128, 120, 108}};
constexpr Rgb8 paints[] = {{190, 192, 194}, {40, 42, 46}, {120, 22, 24}, {28, 52, 98}, {226, 226, 224}, {96, 100, 104}, {58, 76, 60}, {178, 150, 96}};
constexpr Rgb8 leaves[] = {{70, 98, 42}, {84, 112, 48}, {58, 86, 44}, {98, 118, 56}, {112, 116, 52}};

// Borders of streets and lots from 0 until side is reached.
std::vector<double> borders(double side, double street, double lot, uint32_t lots) {
    std::vector<double> at = {0};
    for (uint32_t i = 0; at.back() < side; ++i) at.push_back(at.back() + (i % (lots + 1) == 0 ? street : lot));
    return at;
}

// The number of the interval between borders, which are whole, that each metre lies in.
std::vector<uint32_t> interval_of_metre(const std::vector<double>& at) {
    std::vector<uint32_t> intervals;
    for (uint32_t i = 0; i + 1 < at.size(); ++i) intervals.resize(static_cast<size_t>(at[i + 1]), i);
    return intervals;
}

uint32_t look_up(const std::vector<uint32_t>& intervals, double x) {
    return intervals[static_cast<size_t>(std::clamp(x, 0.0, static_cast<double>(intervals.size() - 1)))];
}

// Fills one cell of the street grid.
class CellBuilder {
public:
    CellBuilder(const City& city, const City::Bounds& lot, Random& random, std::vector<CityBox>& boxes, std::vector<CityTree>& trees)
        : city_(city), lot_(lot), random_(random), boxes_(boxes), trees_(trees), first_box_(boxes.size()) {}
    void house();
    void block_of_flats(double height);
    void parked_cars();
    void trees(uint32_t count, double largest_radius);

private:
    // A box on the rectangle from (x, y) on. The reference is good until the next one.
    CityBox& box(double x, double y, double width, double depth, double z0, double eaves, const Rgb8& wall, const Rgb8& roof);
    void car(double x, double y, bool along_x);
    template <size_t count>
    Rgb8 pick(const Rgb8 (&colors)[count]) {
        return colors[random_.below(count)];
    }

    const City& city_;
    const City::Bounds lot_;
    Random& random_;
    std::vector<CityBox>& boxes_;
    std::vector<CityTree>& trees_;
    size_t first_box_;
};

CityBox& CellBuilder::box(double x, double y, double width, double depth, double z0, double eaves, const Rgb8& wall, const Rgb8& roof) {
    CityBox& box = boxes_.emplace_back();
    box.x0 = x, box.x1 = x + width, box.y0 = y, box.y1 = y + depth;
    box.z0 = z0, box.eaves = eaves;
    box.wall = wall, box.roof = roof;
    return box;
}

void CellBuilder::house() {
    const double width = random_.uniform(9, 14), depth = random_.uniform(8, 11);
    const double x = lot_.x0 + random_.uniform(2, lot_.x1 - lot_.x0 - width - 2), y = lot_.y0 + random_.uniform(4, lot_.y1 - lot_.y0 - depth - 8);
    const double z = city_.ground_height(x + width / 2, y + depth / 2), eaves = z + random_.uniform(3.4, 6.4), ridge = random_.uniform(2.2, 4.2);
    const Rgb8 wall = pick(facades), roof = pick(tiles);
    CityBox& house = box(x, y, width, depth, z - 1, eaves, wall, roof);
    house.ridge = ridge;
    house.windows = true;
    if (random_.below(2)) {  // a chimney
        const double cx = x + width * random_.uniform(0.3, 0.7), cy = y + depth * random_.uniform(0.35, 0.65);
        box(cx, cy, 0.9, 0.7, z, eaves + ridge + 0.9, roof, {70, 60, 56});
    }
    if (random_.below(3)) {  // a shed or a garage behind
        const double gx = lot_.x0 + random_.uniform(1, 14), gy = lot_.y1 - 7.5, gz = city_.ground_height(gx + 2, gy + 3);
        box(gx, gy, 4, 6, gz - 1, gz + 2.6, wall, pick(flat_roofs));
    }
    trees(random_.below(4), 3.6);
}

// A block of flats or a tower, with what stands on its roof.
void CellBuilder::block_of_flats(double height) {
    const double margin = height > 30 ? random_.uniform(2, 4) : random_.uniform(0.5, 1.5);
    const double z = city_.ground_height(0.5 * (lot_.x0 + lot_.x1), 0.5 * (lot_.y0 + lot_.y1)), width = lot_.x1 - lot_.x0 - 2 * margin;
    const bool gabled = height < 16 && random_.below(2);
    const Rgb8 wall = pick(facades), roof = gabled ? pick(tiles) : pick(flat_roofs);
    CityBox& block = box(lot_.x0 + margin, lot_.y0 + margin, width, lot_.y1 - lot_.y0 - 2 * margin, z - 3, z + height, wall, roof);
    block.windows = true;
    if (gabled) {
        block.ridge = random_.uniform(3, 5);
        return;
    }
    CityBox top = block;
    if (height > 40) {  // a second, smaller body on top
        const double inset = random_.uniform(3, 5);
        top.x0 += inset, top.x1 -= inset, top.y0 += inset, top.y1 -= inset;
        top.eaves += random_.uniform(4, 12);
        boxes_.push_back(top);
    }
    for (uint32_t i = 1 + random_.below(4); i > 0; --i) {  // machinery
        const double w = random_.uniform(1.5, 4.5), d = random_.uniform(1.5, 4.5), h = random_.uniform(1, 3.2);
        const double x = random_.uniform(top.x0 + 1, top.x1 - w - 1), y = random_.uniform(top.y0 + 1, top.y1 - d - 1);
        box(x, y, w, d, top.z0, top.eaves + h, {150, 152, 154}, {164, 166, 166});
    }
}

// Parked along both kerbs of a street, or in rows on a lot.
void CellBuilder::parked_cars() {
    const double width = lot_.x1 - lot_.x0, depth = lot_.y1 - lot_.y0;
    const bool along_x = width > depth;
    const double length = along_x ? width : depth, across = along_x ? depth : width;
    for (const double side : {2.2, across - 4.0})
        for (double at = 1; at + 5 < length; at += 5.6) {
            if (random_.below(5) < 2) continue;
            car(lot_.x0 + (along_x ? at : side), lot_.y0 + (along_x ? side : at), along_x);
        }
    if (std::min(width, depth) < 20 && random_.below(2)) trees(1, 2.2);
}

void CellBuilder::car(double x, double y, bool along_x) {
    const double length = random_.uniform(3.9, 4.9), width = 1.8, z = city_.ground_height(x + 1, y + 1), cabin = random_.uniform(0.9, 1.3);
    const double dx = along_x ? length : width, dy = along_x ? width : length, ex = along_x ? cabin : 0.15, ey = along_x ? 0.15 : cabin;
    const Rgb8 paint = pick(paints);
    box(x, y, dx, dy, z - 0.5, z + 0.95, paint, paint).kind = unclassified;
    box(x + ex, y + ey, dx - 2 * ex, dy - 2 * ey, z, z + 1.5, {44, 50, 56}, paint).kind = unclassified;
}

// Trees where nothing else stands.
void CellBuilder::trees(uint32_t count, double largest_radius) {
    for (uint32_t i = 0; i < count; ++i) {
        CityTree tree{};
        tree.radius = random_.uniform(0.45, 1) * largest_radius;
        tree.half_height = tree.radius * random_.uniform(0.9, 1.5);
        tree.x = random_.uniform(lot_.x0 + tree.radius, lot_.x1 - tree.radius);
        tree.y = random_.uniform(lot_.y0 + tree.radius, lot_.y1 - tree.radius);
        tree.z = city_.ground_height(tree.x, tree.y) + tree.half_height + random_.uniform(1.2, 2.5);
        tree.color = pick(leaves);
        const double reach = 0.7 * tree.radius;
        const bool blocked = std::any_of(boxes_.begin() + static_cast<ptrdiff_t>(first_box_), boxes_.end(), [&](const CityBox& box) {
            return tree.x + reach > box.x0 && tree.x - reach < box.x1 && tree.y + reach > box.y0 && tree.y - reach < box.y1;
        });
        if (!blocked) trees_.push_back(tree);
    }
}

}  // namespace

City::City(double side, uint64_t seed) : side_(side), seed_(mix_bits(seed)), has_river_(side >= smallest_city_with_river) {
    xs_ = borders(side, street_x, lot_x, lots_x);
    ys_ = borders(side, street_y, lot_y, lots_y);
    for (double y = 0; y <= side + 2; ++y) {
        const double bend = 0.10 * side * value_noise(y / (0.45 * side), 0.5, seed_ + 31).value + 18 * value_noise(y / 140, 7.5, seed_ + 32).value;
        river_.push_back(0.34 * side + bend);
    }
    column_of_metre_ = interval_of_metre(xs_);
    row_of_metre_ = interval_of_metre(ys_);
    ground_columns_ = static_cast<size_t>((side + 2 * ground_margin) / ground_spacing) + 2;
    ground_.resize(ground_columns_ * ground_columns_);
    parallel_for(ground_columns_, 16, [&](size_t begin, size_t end) {
        for (size_t j = begin; j < end; ++j)
            for (size_t i = 0; i < ground_columns_; ++i)
                ground_[j * ground_columns_ + i] = static_cast<float>(
                    shape_ground(static_cast<double>(i) * ground_spacing - ground_margin, static_cast<double>(j) * ground_spacing - ground_margin));
    });
    cells_.resize(size_t{columns()} * rows());
    for (uint32_t r = 0; r < rows(); ++r)
        for (uint32_t c = 0; c < columns(); ++c) build_cell(c, r);
    find_tops();
}

uint32_t City::column(double x) const { return look_up(column_of_metre_, x); }
uint32_t City::row(double y) const { return look_up(row_of_metre_, y); }

double City::river_distance(double x, double y) const {
    const double at = std::clamp(y, 0.0, side_);
    const auto i = static_cast<size_t>(at);
    const double part = at - static_cast<double>(i);
    return std::abs(x - (river_[i] + part * (river_[i + 1] - river_[i])));
}

double City::shape_ground(double x, double y) const {
    const double hills = typical_height + 13 * value_noise(x / 430, y / 430, seed_ + 11).value + 3 * value_noise(x / 120, y / 120, seed_ + 12).value;
    if (!has_river_) return hills;
    return river_level + (hills - river_level) * smooth_step(0.8 * river_half_width, river_half_width + 130, river_distance(x, y));
}

double City::ground_height(double x, double y) const {
    const double last = static_cast<double>(ground_columns_ - 2);
    const double u = std::clamp((x + ground_margin) / ground_spacing, 0.0, last), v = std::clamp((y + ground_margin) / ground_spacing, 0.0, last);
    const auto i = static_cast<size_t>(u), j = static_cast<size_t>(v);
    const double du = u - static_cast<double>(i), dv = v - static_cast<double>(j);
    const float* const row = &ground_[j * ground_columns_ + i];
    const float* const next = row + ground_columns_;
    const double low = row[0] + du * (double{row[1]} - row[0]), high = next[0] + du * (double{next[1]} - next[0]);
    return low + dv * (high - low);
}

void City::build_cell(uint32_t column, uint32_t row) {
    CityCell& cell = cells_[size_t{row} * columns() + column];
    cell.first_box = static_cast<uint32_t>(boxes_.size());
    cell.first_tree = static_cast<uint32_t>(trees_.size());
    Random random(seed_, 1 + size_t{row} * columns() + column);
    const Bounds lot = bounds(column, row);
    const double x = 0.5 * (lot.x0 + lot.x1), y = 0.5 * (lot.y0 + lot.y1);
    const bool street = column % period_x == 0 || row % period_y == 0;
    // What a whole block is, and how far out it lies: towers in the middle, then blocks of flats, houses outside.
    const uint64_t block = mix_bits(seed_ ^ mix_bits(size_t{row / period_y} << 32 | column / period_x));
    const double outness = std::hypot(x / side_ - 0.55, y / side_ - 0.55) * 2 + 0.18 * value_noise(x / 260, y / 260, seed_ + 21).value;
    CellBuilder build(*this, lot, random, boxes_, trees_);
    if (has_river_ && river_distance(x, y) < river_half_width + 22) {
        cell.use = CellUse::park;
        if (river_distance(x, y) > river_half_width + 8) build.trees(2, 3.5);
    } else if (street) {
        cell.use = column % period_x == 0 && row % period_y == 0 ? CellUse::crossing : CellUse::street;
        if (cell.use == CellUse::street) build.parked_cars();
    } else if (block % 13 == 0) {
        cell.use = CellUse::park;
        build.trees(5 + random.below(5), 5);
    } else if (outness < 0.28) {
        cell.use = CellUse::paved;
        build.block_of_flats(random.uniform(0.3, 1) * std::clamp(side_ / 8, 26.0, tallest));
    } else if (outness < 0.66) {
        cell.use = CellUse::paved;
        if (random.below(8) == 0)
            build.parked_cars();
        else
            build.block_of_flats(random.uniform(9, 23));
    } else {
        cell.use = CellUse::garden;
        build.house();
    }
    cell.box_count = static_cast<uint32_t>(boxes_.size()) - cell.first_box;
    cell.tree_count = static_cast<uint32_t>(trees_.size()) - cell.first_tree;
}

void City::find_tops() {
    for (CityCell& cell : cells_) {
        cell.top = -INFINITY;
        for (const CityBox& box : boxes(cell)) cell.top = std::max(cell.top, box.eaves + box.ridge);
        for (const CityTree& tree : trees(cell)) cell.top = std::max(cell.top, tree.z + tree.half_height);
    }
    for (uint32_t r = 0; r < rows(); ++r)
        for (uint32_t c = 0; c < columns(); ++c) {
            double top = -INFINITY;
            for (uint32_t j = r - std::min(r, neighbours); j <= std::min(r + neighbours, rows() - 1); ++j)
                for (uint32_t i = c - std::min(c, neighbours); i <= std::min(c + neighbours, columns() - 1); ++i) top = std::max(top, cell(i, j).top);
            cells_[size_t{r} * columns() + c].near_top = top;
        }
}

}  // namespace raypager
