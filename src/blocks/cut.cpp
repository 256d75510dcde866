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

// What is known of a set before it is cut.
struct Measure {
    LaneBox centroids;
    uint64_t weight = 0;

    void grow(const PrimitiveRef& ref) {
        const LaneBox box = ref.lanes();
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
    parallel_for(refs.size(), piece, [&](size_t begin, size_t end) {
        Measure part;
        for (const PrimitiveRef& ref : refs.subspan(begin, end - begin)) part.grow(ref);
        std::lock_guard lock(mutex);
        sum.grow(part);
    });
    return sum;
}

BinSet parallel_bins(std::span<const PrimitiveRef> refs, const BinMapping& mapping) {
    BinSet bins(mapping.count);
    std::mutex mutex;
    parallel_for(refs.size(), piece, [&](size_t begin, size_t end) {
        BinSet part(mapping.count);
        part.add(refs.subspan(begin, end - begin), mapping);
        std::lock_guard lock(mutex);
        bins.merge(part);
    });
    return bins;
}

struct Halves {
    size_t middle = 0;
    Measure left, right;
};

Halves partition(std::span<PrimitiveRef> refs, const CutPlane& plane) {
    Halves halves;
    // Each ref is looked at once, and measured on the way.
    const auto middle = std::partition(refs.begin(), refs.end(), [&](const PrimitiveRef& ref) {
        const bool is_left = plane.is_left(ref);
        (is_left ? halves.left : halves.right).grow(ref);
        return is_left;
    });
    halves.middle = static_cast<size_t>(middle - refs.begin());
    return halves;
}

void cut_below(std::span<PrimitiveRef> refs, size_t offset, const Measure& measured, uint64_t limit, std::vector<Part>& parts) {
    if (refs.size() == 1 || measured.weight <= limit) {
        parts.push_back({offset, offset + refs.size()});
        return;
    }
    const Halves halves = partition(refs, CutPlane::choose(refs, measured.centroids, measured.weight));
    cut_below(refs.first(halves.middle), offset, halves.left, limit, parts);
    cut_below(refs.subspan(halves.middle), offset + halves.middle, halves.right, limit, parts);
}

}  // namespace

CutPlane CutPlane::choose(std::span<PrimitiveRef> refs) {
    const Measure measured = measure(refs);
    return choose(refs, measured.centroids, measured.weight);
}

CutPlane CutPlane::choose(std::span<PrimitiveRef> refs, const LaneBox& centroids, uint64_t weight) {
    RAYPAGER_CHECK(refs.size() >= 2);
    const BinMapping mapping(centroids, most_bins);
    const Split split = best_split(parallel_bins(refs, mapping), weight / least_share, true);
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

size_t cut_in_two(std::span<PrimitiveRef> refs) { return partition(refs, CutPlane::choose(refs)).middle; }

std::vector<Part> cut(std::span<PrimitiveRef> refs, uint64_t limit, const std::function<void(std::span<PrimitiveRef>)>& weigh) {
    if (refs.empty()) return {};
    // Large sets are cut level by level: few at a time each by all threads, many at a time each by one. Then the small ones that are left.
    struct Task {
        Part range;
        Measure measured;
        std::vector<Part> parts;
    };
    std::vector<Task> tasks, open = {{{0, refs.size()}, measure(refs), {}}};
    const size_t small = std::max(piece, refs.size() / (8 * worker_count()));
    while (!open.empty()) {
        const auto is_done = [&](const Task& task) { return task.range.end - task.range.begin <= small || task.measured.weight <= limit; };
        const auto large = std::stable_partition(open.begin(), open.end(), is_done);
        tasks.insert(tasks.end(), open.begin(), large);
        open.erase(open.begin(), large);
        std::vector<Task> halves(2 * open.size());
        const auto cut_one = [&](size_t i) {
            const auto [begin, end] = open[i].range;
            const auto range = refs.subspan(begin, end - begin);
            const Halves cut = partition(range, CutPlane::choose(range, open[i].measured.centroids, open[i].measured.weight));
            halves[2 * i] = {{begin, begin + cut.middle}, cut.left, {}};
            halves[2 * i + 1] = {{begin + cut.middle, end}, cut.right, {}};
        };
        if (open.size() < worker_count()) {
            for (size_t i = 0; i < open.size(); i++) cut_one(i);
        } else {
            parallel_for(open.size(), 1, [&](size_t i, size_t) { cut_one(i); });
        }
        open = std::move(halves);
    }
    std::sort(tasks.begin(), tasks.end(), [](const Task& a, const Task& b) { return a.range.begin < b.range.begin; });
    parallel_for(tasks.size(), 1, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; i++) {
            const auto range = refs.subspan(tasks[i].range.begin, tasks[i].range.end - tasks[i].range.begin);
            if (weigh) {
                weigh(range);
                tasks[i].measured = measure(range);
            }
            cut_below(range, tasks[i].range.begin, tasks[i].measured, limit, tasks[i].parts);
        }
    });
    std::vector<Part> parts;
    for (const Task& task : tasks) parts.insert(parts.end(), task.parts.begin(), task.parts.end());
    return parts;
}

}  // namespace raypager
