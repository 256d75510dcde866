#include "blocks/binning.hpp"

#include <algorithm>
#include <limits>

#include "base/check.hpp"

namespace raypager {
namespace {

// By id among equals, so that nothing depends on the order in which refs come.
auto by_centroid(int axis) {
    return [axis](const PrimitiveRef& a, const PrimitiveRef& b) {
        const float x = a.centroid(axis), y = b.centroid(axis);
        return x != y ? x < y : a.id < b.id;
    };
}

void sort_along(std::span<PrimitiveRef> refs, int axis) { std::sort(refs.begin(), refs.end(), by_centroid(axis)); }

}  // namespace

Box centroid_bounds(std::span<const PrimitiveRef> refs) {
    Box bounds;
    for (const PrimitiveRef& ref : refs) bounds.grow(Float3{ref.centroid(0), ref.centroid(1), ref.centroid(2)});
    return bounds;
}

BinMapping::BinMapping(const Box& centroids, int bins) : count(bins) {
    for (int a = 0; a < 3; a++) {
        const float extent = centroids.upper[a] - centroids.lower[a];
        origin[a] = centroids.lower[a];
        // Extents so small that the quotient overflows are left to the median.
        const float quotient = static_cast<float>(bins) / extent;
        scale[a] = quotient <= std::numeric_limits<float>::max() ? quotient : 0;
    }
}

void BinSet::add(std::span<const PrimitiveRef> refs, const BinMapping& mapping) {
    for (const PrimitiveRef& ref : refs) {
        for (int a = 0; a < 3; a++) {
            Bin& bin = axes[a][mapping.bin(ref, a)];
            bin.box.grow(ref.box);
            bin.weight += ref.weight;
            bin.count++;
        }
    }
}

void BinSet::merge(const BinSet& other, int bins) {
    for (int a = 0; a < 3; a++) {
        for (int i = 0; i < bins; i++) {
            axes[a][i].box.grow(other.axes[a][i].box);
            axes[a][i].weight += other.axes[a][i].weight;
            axes[a][i].count += other.axes[a][i].count;
        }
    }
}

Split best_split(const BinSet& bins, int count, uint64_t least_weight, bool by_weight) {
    Split best;
    for (int a = 0; a < 3; a++) {
        const auto& axis = bins.axes[a];
        std::array<double, most_bins> cost_right = {};
        std::array<uint64_t, most_bins> weight_right = {};
        std::array<uint32_t, most_bins> count_right = {};
        BinSet::Bin sum;
        const auto take = [&](const BinSet::Bin& bin) {
            sum.box.grow(bin.box);
            sum.weight += bin.weight;
            sum.count += bin.count;
        };
        const auto cost = [&] { return sum.box.half_area() * static_cast<double>(by_weight ? sum.weight : sum.count); };
        for (int i = count - 1; i > 0; i--) {
            take(axis[i]);
            cost_right[i] = cost();
            weight_right[i] = sum.weight;
            count_right[i] = sum.count;
        }
        sum = {};
        for (int i = 1; i < count; i++) {
            take(axis[i - 1]);
            if (sum.count == 0 || count_right[i] == 0 || sum.weight < least_weight || weight_right[i] < least_weight) continue;
            const double total = cost() + cost_right[i];
            if (best.axis < 0 || total < best.cost) best = {a, i, total};
        }
    }
    return best;
}

size_t split_by_sweep(std::span<PrimitiveRef> refs, size_t step) {
    const size_t n = refs.size();
    RAYPAGER_CHECK(step < n && n <= most_swept);
    int best_axis = 0, sorted_axis = 0;
    size_t best_middle = 0;
    double best_cost = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; axis++) {
        sort_along(refs, sorted_axis = axis);
        std::array<double, most_swept> right;
        Box box;
        for (size_t i = n - 1; i > 0; i--) {
            box.grow(refs[i].box);
            right[i] = box.half_area() * static_cast<double>(n - i);
        }
        box = {};
        for (size_t i = 1; i < n; i++) {
            box.grow(refs[i - 1].box);
            const double cost = box.half_area() * static_cast<double>(i) + right[i];
            if (i % step != 0 || !(cost < best_cost)) continue;
            best_cost = cost;
            best_middle = i;
            best_axis = axis;
        }
    }
    if (best_axis != sorted_axis) sort_along(refs, best_axis);
    return best_middle;
}

int widest_axis(const Box& box) {
    int axis = 0;
    for (int a = 1; a < 3; a++)
        if (box.upper[a] - box.lower[a] > box.upper[axis] - box.lower[axis]) axis = a;
    return axis;
}

size_t split_at_median(std::span<PrimitiveRef> refs, const Box& centroids) {
    const int axis = widest_axis(centroids);
    const size_t middle = refs.size() / 2;
    std::nth_element(refs.begin(), refs.begin() + static_cast<ptrdiff_t>(middle), refs.end(), by_centroid(axis));
    return middle;
}

}  // namespace raypager
