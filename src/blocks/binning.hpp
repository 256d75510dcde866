// Where to split a set of boxes in two: the binned surface area heuristic (SAH; Wald, "On fast Construction of SAH-based Bounding
// Volume Hierarchies", 2007), shared by the cut into blocks, the trees inside blocks and the top tree.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "blocks/world.hpp"

namespace raypager {

inline constexpr int most_bins = 32;

// Bounds of twice the centres.
Box centroid_bounds(std::span<const PrimitiveRef> refs);

// Maps centres to bins, monotonically on each axis.
struct BinMapping {
    BinMapping(const Box& centroids, int bins);
    int bin(const PrimitiveRef& ref, int axis) const {
        return std::min(count - 1, static_cast<int>((ref.centroid(axis) - origin[axis]) * scale[axis]));
    }
    float origin[3], scale[3];
    int count;
};

struct BinSet {
    struct Bin {
        Box box;
        uint64_t weight = 0;
        uint32_t count = 0;
    };
    void add(std::span<const PrimitiveRef> refs, const BinMapping& mapping);
    void merge(const BinSet& other, int bins);
    std::array<std::array<Bin, most_bins>, 3> axes;
};

// Left: what has bin(axis) < bin.
struct Split {
    int axis = -1;  // -1: there is none
    int bin = 0;
    double cost = 0;  // half area times count, summed over both sides
};

// The cheapest split that leaves something, and at least least_weight, on either side. by_weight: cost counts weights, not primitives.
Split best_split(const BinSet& bins, int count, uint64_t least_weight, bool by_weight);

// The cheapest split of all at the multiples of step, on any axis: the number of refs that are moved to the front.
// REQUIRES: step < refs.size() <= most_swept.
inline constexpr size_t most_swept = 64;
size_t split_by_sweep(std::span<PrimitiveRef> refs, size_t step);

int widest_axis(const Box& box);
// Splits at the median centre of the widest axis, by id among equals: the number of refs that are moved to the front.
size_t split_at_median(std::span<PrimitiveRef> refs, const Box& centroids);

}  // namespace raypager
