#include "block/wide_node.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/check.hpp"
#include "block/grid.hpp"

namespace raypager {
namespace {

constexpr int exponent_bias = 127, min_exponent = 1, largest_exponent = 254;

float cell_of(uint32_t exponent) { return std::bit_cast<float>(exponent << 23); }

// The box's slack: the same on every side.
double slack_of(const Box& box) {
    double extent = 0, coordinate = 0;
    for (int a = 0; a < 3; a++) {
        extent = std::max(extent, double(box.upper[a]) - box.lower[a]);
        coordinate = std::max({coordinate, std::abs(double(box.lower[a])), std::abs(double(box.upper[a]))});
    }
    // Beside the largest coordinate a box may be so small that its slack vanishes; then it still is a normal number.
    return std::max({extent * RP_WIDE_SLACK_OF_EXTENT, coordinate * RP_WIDE_SLACK_OF_COORDINATE, 0x1p-100});
}

// The smallest cell that spans the interval in 255 steps and on whose multiples, so far from 0, single precision is exact.
uint32_t choose_exponent(Interval all) {
    const double largest = std::max(std::abs(all.lower), std::abs(all.upper));
    int exponent = std::max(std::ilogb(largest) - 22, std::ilogb((all.upper - all.lower) / 255)) + exponent_bias;
    for (exponent = std::max(exponent, min_exponent); exponent < largest_exponent; exponent++) {
        const double cell = cell_of(static_cast<uint32_t>(exponent));
        if (std::ceil(all.upper / cell) - std::floor(all.lower / cell) <= 255) break;
    }
    return static_cast<uint32_t>(exponent);
}

}  // namespace

void quantise(std::span<const Box> boxes, rp_wide_node& node) {
    RAYPAGER_CHECK(!boxes.empty() && boxes.size() <= RP_WIDE_CHILDREN);
    node.count = static_cast<rp_u8>(boxes.size());
    double slack[RP_WIDE_CHILDREN];
    for (size_t k = 0; k < boxes.size(); k++) slack[k] = slack_of(boxes[k]);
    for (int a = 0; a < 3; a++) {
        Interval all = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
        for (size_t k = 0; k < boxes.size(); k++) {
            all.lower = std::min(all.lower, boxes[k].lower[a] - slack[k]);
            all.upper = std::max(all.upper, boxes[k].upper[a] + slack[k]);
        }
        const uint32_t exponent = choose_exponent(all);
        const double cell = cell_of(exponent), first = std::floor(all.lower / cell);
        node.exponent[a] = static_cast<rp_u8>(exponent);
        node.origin[a] = static_cast<float>(first * cell);
        for (size_t k = 0; k < boxes.size(); k++) {
            const double lower = std::floor((boxes[k].lower[a] - slack[k]) / cell) - first,
                         upper = std::ceil((boxes[k].upper[a] + slack[k]) / cell) - first;
            RAYPAGER_CHECK(lower >= 0 && upper <= 255);
            node.lower[a][k] = static_cast<rp_u8>(lower);
            node.upper[a][k] = static_cast<rp_u8>(upper);
        }
    }
}

Box with_slack(const Box& box) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    const double slack = slack_of(box);
    Box larger;
    for (int a = 0; a < 3; a++) {
        const double lower = box.lower[a] - slack, upper = box.upper[a] + slack;
        larger.lower[a] = static_cast<float>(lower);
        larger.upper[a] = static_cast<float>(upper);
        if (larger.lower[a] > lower) larger.lower[a] = std::nextafter(larger.lower[a], -inf);
        if (larger.upper[a] < upper) larger.upper[a] = std::nextafter(larger.upper[a], inf);
    }
    return larger;
}

Box stored_box(const rp_wide_node& node, uint32_t child) {
    Box box;
    for (int a = 0; a < 3; a++) {
        const float cell = cell_of(node.exponent[a]);
        box.lower[a] = node.origin[a] + cell * static_cast<float>(node.lower[a][child]);
        box.upper[a] = node.origin[a] + cell * static_cast<float>(node.upper[a][child]);
    }
    return box;
}

}  // namespace raypager
