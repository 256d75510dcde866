#include "cut/cut.hpp"

#include <algorithm>
#include <mutex>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "cut/binning.hpp"

namespace raypager {
namespace {

// No side of a split gets less than this share of the bytes (of a sample's, in large sets), so that blocks stay even.
constexpr uint64_t min_share = 9;  // 1 : 8

// What one thread does of a set at a time, if all work on it together.
constexpr size_t piece_refs = size_t{1} << 16;

// Where to cut a set is found on so many of it.
constexpr size_t most_sampled = size_t{1} << 14;

// What is known of a set before it is cut.
struct Measure {
    Box4 centroids;
    uint64_t weight = 0;

    void grow(const PrimitiveRef& ref) {
        const Box4 box = ref.box4();
        centroids.grow(box.lower + box.upper);
        weight += ref.weight;
    }
    void grow(const Measure& other) {
        centroids.grow(other.centroids);
        weight += other.weight;
    }
};

// Sums of integers, minima and maxima: the same in whichever order threads come.
Measure measure(std::span<const PrimitiveRef> refs) {
    Measure sum;
    std::mutex mutex;
    parallel_for(refs.size(), piece_refs, [&](size_t begin, size_t end) {
        Measure part;
        for (const PrimitiveRef& ref : refs.subspan(begin, end - begin)) part.grow(ref);
        std::lock_guard lock(mutex);
        sum.grow(part);
    });
    return sum;
}

struct CutHalves {
    size_t middle = 0;
    Measure left, right;
};

CutHalves partition_alone(std::span<PrimitiveRef> refs, const CutPlane& plane) {
    CutHalves halves;
    // Each ref is looked at once, and measured on the way.
    const auto middle = std::partition(refs.begin(), refs.end(), [&](const PrimitiveRef& ref) {
        const bool is_left = plane.is_left(ref);
        (is_left ? halves.left : halves.right).grow(ref);
        return is_left;
    });
    halves.middle = static_cast<size_t>(middle - refs.begin());
    return halves;
}

// Pieces are partitioned by all threads together. Then what is on the wrong side of the middle of all changes places: the n-th of those on the
// left with the n-th of those on the right.
CutHalves partition(std::span<PrimitiveRef> refs, const CutPlane& plane) {
    if (refs.size() <= piece_refs) return partition_alone(refs, plane);
    std::vector<CutHalves> pieces((refs.size() + piece_refs - 1) / piece_refs);
    parallel_for(refs.size(), piece_refs,
                 [&](size_t begin, size_t end) { pieces[begin / piece_refs] = partition_alone(refs.subspan(begin, end - begin), plane); });
    CutHalves all;
    for (const CutHalves& halves : pieces) {
        all.middle += halves.middle;
        all.left.grow(halves.left);
        all.right.grow(halves.right);
    }
    std::vector<Part> wrong_left, wrong_right;
    for (size_t i = 0; i < pieces.size(); i++) {
        const size_t begin = i * piece_refs, middle = begin + pieces[i].middle, end = std::min(begin + piece_refs, refs.size());
        if (middle < std::min(end, all.middle)) wrong_left.push_back({middle, std::min(end, all.middle)});
        if (std::max(begin, all.middle) < middle) wrong_right.push_back({std::max(begin, all.middle), middle});
    }
    struct Exchange {
        size_t left, right, count;
    };
    std::vector<Exchange> exchanges;
    for (size_t l = 0, r = 0; l < wrong_left.size();) {
        const size_t count = std::min(wrong_left[l].end - wrong_left[l].begin, wrong_right[r].end - wrong_right[r].begin);
        exchanges.push_back({wrong_left[l].begin, wrong_right[r].begin, count});
        if ((wrong_left[l].begin += count) == wrong_left[l].end) l++;
        if ((wrong_right[r].begin += count) == wrong_right[r].end) r++;
    }
    parallel_for(exchanges.size(), 1, [&](size_t i, size_t) {
        const Exchange& e = exchanges[i];
        std::swap_ranges(refs.begin() + static_cast<ptrdiff_t>(e.left), refs.begin() + static_cast<ptrdiff_t>(e.left + e.count),
                         refs.begin() + static_cast<ptrdiff_t>(e.right));
    });
    return all;
}

void cut_below(std::span<PrimitiveRef> refs, size_t offset, const Measure& measured, uint64_t limit, std::vector<Part>& parts) {
    if (refs.size() == 1 || measured.weight <= limit) {
        parts.push_back({offset, offset + refs.size()});
        return;
    }
    const CutHalves halves = partition(refs, CutPlane::choose(refs, measured.centroids));
    cut_below(refs.first(halves.middle), offset, halves.left, limit, parts);
    cut_below(refs.subspan(halves.middle), offset + halves.middle, halves.right, limit, parts);
}

}  // namespace

CutPlane CutPlane::choose(std::span<PrimitiveRef> refs) {
    const Measure measured = measure(refs);
    return choose(refs, measured.centroids);
}

CutPlane CutPlane::choose(std::span<PrimitiveRef> refs, const Box4& centroids) {
    RAYPAGER_CHECK(refs.size() >= 2);
    const BinMapping mapping(centroids, max_bins);
    const BinSet bins(refs, mapping, most_sampled);
    uint64_t weight = 0;
    for (const BinSet::Bin& bin : bins.axis(0)) weight += bin.weight();
    const Split split = best_split(bins, weight / min_share, true);
    CutPlane plane;
    if (split.axis >= 0) {
        plane.axis_ = split.axis;
        plane.origin_ = mapping.origin[split.axis];
        plane.scale_ = mapping.scale[split.axis];
        plane.bin_ = static_cast<float>(split.bin);
    } else {
        const PrimitiveRef& first_right = refs[split_at_median(refs, centroids)];
        plane.axis_ = widest_axis(centroids);
        plane.origin_ = first_right.centroid(plane.axis_);
        plane.id_ = first_right.id;
    }
    return plane;
}

size_t cut_in_two(std::span<PrimitiveRef> refs) { return cut_in_two(refs, CutPlane::choose(refs)); }

size_t cut_in_two(std::span<PrimitiveRef> refs, const CutPlane& plane) { return partition(refs, plane).middle; }

std::vector<Part> cut(std::span<PrimitiveRef> refs, uint64_t limit) {
    std::vector<Part> parts;
    if (!refs.empty()) cut_below(refs, 0, measure(refs), limit, parts);
    return parts;
}

}  // namespace raypager
