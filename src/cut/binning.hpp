// Where to split a set of boxes in two: the binned surface area heuristic (SAH; Wald, "On fast Construction of SAH-based Bounding
// Volume Hierarchies", 2007), shared by the cut into blocks, the trees inside blocks and the top tree.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "world/world.hpp"

namespace raypager {

inline constexpr int max_bins = 32;

// What holds a set of boxes, and what holds twice their centres.
struct Extent {
    Box4 box, centroids;

    void grow(const PrimitiveRef& ref) {
        const Box4 added = ref.box4();
        box.grow(added);
        centroids.grow(added.lower + added.upper);
    }
    void grow(const Extent& other) {
        box.grow(other.box);
        centroids.grow(other.centroids);
    }
};
Extent extent_of(std::span<const PrimitiveRef> refs);

// Maps centres to bins, monotonically on each axis.
struct BinMapping {
    BinMapping(const Box4& centroids, int bins);
    Float4 origin = {}, scale = {};
    int count;
};

struct BinSet {
    struct Bin {
        Box4 box;
        uint64_t sums = 0;  // weights above, count below, so that one addition does for both
        uint64_t weight() const { return sums >> 32; }
        uint32_t count() const { return static_cast<uint32_t>(sums); }
        void add(const Bin& other) {
            box.grow(other.box);
            sums += other.sums;
        }
    };
    // Of all refs, or, if they are more than 2 * most_sampled, of most_sampled of them. Weights are of use only if they add up to less than 2^32.
    BinSet(std::span<const PrimitiveRef> refs, const BinMapping& mapping, size_t most_sampled);
    std::span<const Bin> axis(int a) const {
        const auto count = static_cast<size_t>(count_);
        return std::span(bins_).subspan(static_cast<size_t>(a) * count, count);
    }
    int count() const { return count_; }

private:
    void add(const PrimitiveRef& ref, const BinMapping& mapping);
    union {
        std::array<Bin, 3 * max_bins> bins_;  // of which the first 3 * count_ are there: small sets use few
    };
    int count_;
};

// Left: what has (centroid(axis) - origin) * scale < bin.
struct Split {
    int axis = -1;  // -1: there is none
    int bin = 0;
    float cost = 0;  // half area times count, summed over both sides
};

// The cheapest split that leaves something, and at least min_weight, on either side. by_weight: cost counts weights, not primitives.
Split best_split(const BinSet& bins, uint64_t min_weight, bool by_weight);

// The cheapest split of all at the multiples of step, on any axis: the number of refs that are moved to the front.
// REQUIRES: step < refs.size() <= most_swept.
inline constexpr size_t most_swept = 64;
size_t split_by_sweep(std::span<PrimitiveRef> refs, size_t step);

int widest_axis(const Box4& box);
// Splits at the median centre of the widest axis, by id among equals: the number of refs that are moved to the front.
size_t split_at_median(std::span<PrimitiveRef> refs, const Box4& centroids);

}  // namespace raypager
