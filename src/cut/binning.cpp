#include "cut/binning.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/check.hpp"
#include "base/jitter.hpp"
#include "cut/float_order.hpp"

namespace raypager {
namespace {

// By id among equals, so that nothing depends on the order in which refs come.
auto by_centroid(int axis) {
    return [axis](const PrimitiveRef& a, const PrimitiveRef& b) {
        const float x = a.centroid(axis), y = b.centroid(axis);
        return x != y ? x < y : a.id < b.id;
    };
}

// The same order on whole numbers.
uint64_t sort_key(const PrimitiveRef& ref, int axis) {
    return uint64_t{float_order(ref.centroid(axis) + 0.0f)} << 32 | ref.id;  // -0 becomes 0
}

struct SortedPlace {
    uint64_t key;
    uint32_t place;
    bool operator<(const SortedPlace& other) const { return key < other.key; }
};

using SortedPlaces = std::array<SortedPlace, most_swept>;

void sort_along(std::span<const PrimitiveRef> refs, int axis, SortedPlaces& sorted) {
    constexpr size_t few = 16;
    for (size_t i = 0; i < refs.size(); i++) {
        const SortedPlace item = {sort_key(refs[i], axis), static_cast<uint32_t>(i)};
        size_t at = i;
        if (refs.size() <= few)
            for (; at > 0 && item < sorted[at - 1]; at--) sorted[at] = sorted[at - 1];
        sorted[at] = item;
    }
    if (refs.size() > few) std::sort(sorted.begin(), sorted.begin() + static_cast<ptrdiff_t>(refs.size()));
}

}  // namespace

Extent extent_of(std::span<const PrimitiveRef> refs) {
    Extent extent;
    for (const PrimitiveRef& ref : refs) extent.grow(ref);
    return extent;
}

BinMapping::BinMapping(const Box4& centroids, int bins) : count(bins) {
    for (int a = 0; a < 3; a++) {
        const float extent = centroids.upper[a] - centroids.lower[a];
        origin[a] = centroids.lower[a];
        // Extents so small that the quotient overflows are left to the median.
        const float quotient = static_cast<float>(bins) / extent;
        scale[a] = quotient <= std::numeric_limits<float>::max() ? quotient : 0;
    }
}

BinSet::BinSet(std::span<const PrimitiveRef> refs, const BinMapping& mapping, size_t most_sampled) : count_(mapping.count) {
    std::uninitialized_fill_n(bins_.data(), 3 * count_, Bin());
    if (refs.size() <= 2 * most_sampled) {
        for (const PrimitiveRef& ref : refs) add(ref, mapping);
        return;
    }
    for (size_t i = 0; i < most_sampled; i++) add(refs[one_of_stretch(i, most_sampled, refs.size())], mapping);
}

inline void BinSet::add(const PrimitiveRef& ref, const BinMapping& mapping) {
    const float last = static_cast<float>(count_ - 1);
    const Float4 limit = {last, last, last, last};
    const Box4 box = ref.box4();
    const Float4 place = least((box.lower + box.upper - mapping.origin) * mapping.scale, limit);
    // All at once: taking them from the vector one by one goes through memory, which costs three times as much as all the rest.
    const auto bin = __builtin_convertvector(place, Int4);
    const uint64_t sums = uint64_t{ref.weight} << 32 | 1;
    using LanePairs = uint64_t __attribute__((vector_size(16)));
    const auto pairs = std::bit_cast<LanePairs>(bin);
    const uint64_t xy = pairs[0], z = pairs[1];
    const auto count = static_cast<size_t>(count_);
    const auto put = [&](size_t at) {
        Bin& target = bins_[at];
        target.box.grow(box);
        target.sums += sums;
    };
    put(static_cast<uint32_t>(xy));
    put(count + (xy >> 32));
    put(2 * count + static_cast<uint32_t>(z));
}

Split best_split(const BinSet& bins, uint64_t min_weight, bool by_weight) {
    Split best;
    const auto count = static_cast<size_t>(bins.count());
    const auto cost = [by_weight](const BinSet::Bin& sum) {
        if (sum.count() == 0) return 0.0f;
        return sum.box.rough_half_area() * static_cast<float>(by_weight ? sum.weight() : sum.count());
    };
    for (int a = 0; a < 3; a++) {
        const auto axis = bins.axis(a);
        std::array<float, max_bins> cost_right;
        std::array<uint64_t, max_bins> weight_right;
        std::array<uint32_t, max_bins> count_right;
        BinSet::Bin sum;
        for (size_t i = count - 1; i > 0; i--) {
            sum.add(axis[i]);
            cost_right[i] = cost(sum);
            weight_right[i] = sum.weight();
            count_right[i] = sum.count();
        }
        sum = {};
        for (size_t i = 1; i < count; i++) {
            sum.add(axis[i - 1]);
            if (sum.count() == 0 || count_right[i] == 0 || sum.weight() < min_weight || weight_right[i] < min_weight) continue;
            const float total = cost(sum) + cost_right[i];
            if (best.axis < 0 || total < best.cost) best = {a, static_cast<int>(i), total};
        }
    }
    return best;
}

size_t split_by_sweep(std::span<PrimitiveRef> refs, size_t step) {
    const size_t n = refs.size();
    RAYPAGER_CHECK(step < n && n <= most_swept);
    // There is one way to split two, at the same cost on all axes, of which the first one is taken below.
    if (n == 2) {
        if (sort_key(refs[1], 0) < sort_key(refs[0], 0)) std::swap(refs[0], refs[1]);
        return 1;
    }
    std::array<SortedPlaces, 3> sorted;
    size_t best_axis = 0, best_middle = step;
    float best_cost = std::numeric_limits<float>::infinity();
    for (size_t axis = 0; axis < 3; axis++) {
        sort_along(refs, static_cast<int>(axis), sorted[axis]);
        const auto box_of = [&](size_t i) { return refs[sorted[axis][i].place].box4(); };
        std::array<float, most_swept> right;
        Box4 box;
        for (size_t i = n - 1; i > 0; i--) {
            box.grow(box_of(i));
            right[i] = box.rough_half_area() * static_cast<float>(n - i);
        }
        box = {};
        for (size_t i = 1; i < n; i++) {
            box.grow(box_of(i - 1));
            const float cost = box.rough_half_area() * static_cast<float>(i) + right[i];
            if (i % step != 0 || !(cost < best_cost)) continue;
            best_cost = cost;
            best_middle = i;
            best_axis = axis;
        }
    }
    std::array<PrimitiveRef, most_swept> copy;
    std::copy(refs.begin(), refs.end(), copy.begin());
    for (size_t i = 0; i < n; i++) refs[i] = copy[sorted[best_axis][i].place];
    return best_middle;
}

int widest_axis(const Box4& box) {
    int axis = 0;
    for (int a = 1; a < 3; a++)
        if (box.upper[a] - box.lower[a] > box.upper[axis] - box.lower[axis]) axis = a;
    return axis;
}

size_t split_at_median(std::span<PrimitiveRef> refs, const Box4& centroids) {
    const int axis = widest_axis(centroids);
    const size_t middle = refs.size() / 2;
    std::nth_element(refs.begin(), refs.begin() + static_cast<ptrdiff_t>(middle), refs.end(), by_centroid(axis));
    return middle;
}

}  // namespace raypager
