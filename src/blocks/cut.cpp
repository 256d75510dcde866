#include "blocks/cut.hpp"

#include <algorithm>
#include <mutex>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "blocks/binning.hpp"

namespace raypager {
namespace {

// No side of a split gets less than this share of the bytes, so that blocks stay even.
constexpr uint64_t least_share = 9;  // 1 : 8

// Sets larger than this are binned by all threads together, smaller ones each by one thread.
constexpr size_t piece = size_t{1} << 16;

uint64_t total_weight(std::span<const PrimitiveRef> refs) {
    uint64_t sum = 0;
    for (const PrimitiveRef& ref : refs) sum += ref.weight;
    return sum;
}

Box parallel_centroid_bounds(std::span<const PrimitiveRef> refs) {
    Box bounds;
    std::mutex mutex;
    parallel_for(refs.size(), piece, [&](size_t begin, size_t end) {
        const Box part = centroid_bounds(refs.subspan(begin, end - begin));
        std::lock_guard lock(mutex);
        bounds.grow(part);
    });
    return bounds;
}

// Sums of integers, minima and maxima: the same in whichever order threads come.
BinSet parallel_bins(std::span<const PrimitiveRef> refs, const BinMapping& mapping) {
    BinSet bins;
    std::mutex mutex;
    parallel_for(refs.size(), piece, [&](size_t begin, size_t end) {
        BinSet part;
        part.add(refs.subspan(begin, end - begin), mapping);
        std::lock_guard lock(mutex);
        bins.merge(part, mapping.count);
    });
    return bins;
}

void cut_below(std::span<PrimitiveRef> refs, size_t offset, uint64_t limit, std::vector<Part>& parts) {
    if (refs.size() == 1 || total_weight(refs) <= limit) {
        parts.push_back({offset, offset + refs.size()});
        return;
    }
    const size_t middle = cut_in_two(refs);
    cut_below(refs.first(middle), offset, limit, parts);
    cut_below(refs.subspan(middle), offset + middle, limit, parts);
}

}  // namespace

CutPlane CutPlane::choose(std::span<PrimitiveRef> refs) {
    RAYPAGER_CHECK(refs.size() >= 2);
    const Box centroids = parallel_centroid_bounds(refs);
    const BinMapping mapping(centroids, most_bins);
    const BinSet bins = parallel_bins(refs, mapping);
    uint64_t weight = 0;
    for (const BinSet::Bin& bin : bins.axes[0]) weight += bin.weight;
    const Split split = best_split(bins, most_bins, weight / least_share, true);
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

size_t cut_in_two(std::span<PrimitiveRef> refs) {
    const CutPlane plane = CutPlane::choose(refs);
    const auto middle = std::partition(refs.begin(), refs.end(), [&](const PrimitiveRef& ref) { return plane.is_left(ref); });
    return static_cast<size_t>(middle - refs.begin());
}

std::vector<Part> cut(std::span<PrimitiveRef> refs, uint64_t limit, const std::function<void(std::span<PrimitiveRef>)>& weigh) {
    if (refs.empty()) return {};
    // Large sets are cut one after the other, each by all threads; then the small ones that are left, each by one thread.
    struct Task {
        Part range;
        std::vector<Part> parts;
    };
    std::vector<Task> tasks, stack = {{{0, refs.size()}, {}}};
    const size_t small = std::max(piece, refs.size() / (8 * worker_count()));
    while (!stack.empty()) {
        Task task = std::move(stack.back());
        stack.pop_back();
        const auto [begin, end] = task.range;
        if (end - begin <= small || total_weight(refs.subspan(begin, end - begin)) <= limit) {
            tasks.push_back(std::move(task));
            continue;
        }
        const size_t middle = begin + cut_in_two(refs.subspan(begin, end - begin));
        stack.push_back({{middle, end}, {}});
        stack.push_back({{begin, middle}, {}});
    }
    parallel_for(tasks.size(), 1, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; i++) {
            const auto [begin, end] = tasks[i].range;
            if (weigh) weigh(refs.subspan(begin, end - begin));
            cut_below(refs.subspan(begin, end - begin), begin, limit, tasks[i].parts);
        }
    });
    std::vector<Part> parts;
    for (const Task& task : tasks) parts.insert(parts.end(), task.parts.begin(), task.parts.end());
    return parts;
}

}  // namespace raypager
