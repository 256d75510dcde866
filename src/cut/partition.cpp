#include "cut/partition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "base/check.hpp"
#include "base/jitter.hpp"
#include "base/parallel.hpp"
#include "cut/binning.hpp"
#include "cut/float_order.hpp"

namespace raypager {
Partition::Partition(PrimitiveRefs sample, double limit, size_t most) {
    RAYPAGER_CHECK(sample.size() >= 2);
    struct Open {
        uint64_t weight;
        uint32_t node;
        std::span<PrimitiveRef> refs;
        bool operator<(const Open& other) const { return weight != other.weight ? weight < other.weight : node > other.node; }
    };
    std::priority_queue<Open> open;
    nodes_.emplace_back();
    open.push({weight_of(sample), 0, sample});
    const Box4 centroids = extent_of(sample).centroids;
    for (size_t parts = 1; parts < std::max<size_t>(2, most) && !open.empty();) {
        const Open heaviest = open.top();
        open.pop();
        if (heaviest.refs.size() < 2) continue;
        if (parts >= 2 && static_cast<double>(heaviest.weight) <= limit) break;
        const CutPlane plane = CutPlane::choose(heaviest.refs);
        const size_t count = cut_in_two(heaviest.refs, plane);
        const auto left = static_cast<uint32_t>(nodes_.size());
        nodes_[heaviest.node].plane = plane;
        nodes_[heaviest.node].left = left;
        nodes_.resize(nodes_.size() + 2);
        for (const auto& [node, refs] : {std::pair(left, heaviest.refs.first(count)), std::pair(left + 1, heaviest.refs.subspan(count))})
            open.push({weight_of(refs), node, refs});
        parts++;
    }
    number(0);
    RAYPAGER_CHECK(nodes_.size() <= UINT16_MAX);
    make_grid(centroids, sample.size());
    enter(0, {{0, 0, 0}, count_});
    for (auto& first : first_) first = {};
}

// Cells that are about cubes, so that a flat scene has more of them along it.
void Partition::make_grid(const Box4& centroids, size_t samples) {
    constexpr double most_along = 1024;
    const double max_cells = static_cast<double>(std::clamp<size_t>(4 * samples, 1, size_t{1} << 20));
    double extent[3], longest = 0;
    for (int a = 0; a < 3; a++) longest = std::max(longest, extent[a] = double(centroids.upper[a]) - centroids.lower[a]);
    const auto count = [&](int a, double size) { return std::clamp(std::floor(extent[a] / size), 1.0, most_along); };
    double size = longest / most_along;
    while (size > 0 && count(0, size) * count(1, size) * count(2, size) > max_cells) size *= 1.1;
    for (int a = 0; a < 3; a++) {
        origin_[a] = centroids.lower[a];
        const float scale = size > 0 ? static_cast<float>(count(a, size) / extent[a]) : 0;
        if (!(scale > 0 && scale <= std::numeric_limits<float>::max())) continue;  // one cell
        scale_[a] = scale;
        count_[a] = static_cast<uint32_t>(count(a, size));
        last_[a] = static_cast<float>(count_[a] - 1);
    }
    cells_.resize(size_t{count_[0]} * count_[1] * count_[2]);
    // Which centres are in a cell, to the last bit: found by halving, among the floats in their order.
    for (int a = 0; a < 3; a++) {
        const auto cell = [&](float centroid) { return std::max(std::min((centroid - origin_[a]) * scale_[a], last_[a]), 0.0f); };
        first_[a].assign(count_[a] + 1, -std::numeric_limits<float>::max());
        first_[a].back() = std::numeric_limits<float>::infinity();
        for (uint32_t i = 1; i < count_[a]; i++) {
            // From the least of all: where floats are coarser than cells, some cells have none, and begin where the next one does.
            uint32_t below = float_order(-std::numeric_limits<float>::max()), from = float_order(std::numeric_limits<float>::max());
            while (from - below > 1) {
                const uint32_t middle = below + (from - below) / 2;
                (cell(float_at(middle)) < static_cast<float>(i) ? below : from) = middle;
            }
            first_[a][i] = float_at(from);
        }
    }
}

// Which side of a plane a centre is on follows from its place along the axis alone, and only once changes along it.
void Partition::enter(uint32_t node, const Cells& cells) {
    if (const uint32_t left = nodes_[node].left) {
        const CutPlane& plane = nodes_[node].plane;
        const auto axis = static_cast<size_t>(plane.axis());
        const auto& first = first_[axis];
        // Cells up to `middle` are on the left, those from `right` on on the right; at most one between them is on both sides.
        uint32_t middle = cells.begin[axis];
        for (uint32_t end = cells.end[axis]; middle < end;) {
            const uint32_t half = middle + (end - middle) / 2;
            if (plane.is_left_of(std::nextafter(first[half + 1], -std::numeric_limits<float>::infinity())))
                middle = half + 1;
            else
                end = half;
        }
        const uint32_t right = std::min(cells.end[axis], middle + !plane.is_right_of(first[middle]));
        Cells part = cells;
        part.end[axis] = middle;
        if (part.begin[axis] < middle) enter(left, part);
        part = cells;
        part.begin[axis] = right;
        if (right < part.end[axis]) enter(left + 1, part);
        if (middle == right) return;
        part = cells;
        part.begin[axis] = middle;
        part.end[axis] = right;
        return fill(node, part);
    }
    fill(node, cells);
}

void Partition::fill(uint32_t node, const Cells& cells) {
    for (uint32_t z = cells.begin[2]; z < cells.end[2]; z++)
        for (uint32_t y = cells.begin[1]; y < cells.end[1]; y++)
            std::fill_n(cells_.begin() + static_cast<ptrdiff_t>((size_t{z} * count_[1] + y) * count_[0] + cells.begin[0]),
                        cells.end[0] - cells.begin[0], static_cast<uint16_t>(node));
}

void Partition::number(uint32_t node) {
    if (nodes_[node].left == 0) {
        nodes_[node].part = parts_++;
        return;
    }
    number(nodes_[node].left);
    number(nodes_[node].left + 1);
}

Result<PrimitiveRefs> sample_bucket(const Bucket& bucket, uint64_t count) {
    const uint64_t all = bucket.primitives();
    count = std::min(count, all);
    PrimitiveRefs sample(count);
    const auto take = [&](uint64_t i) -> Status {
        uint64_t place = one_of_stretch(i, count, all);
        uint32_t kind = 0;
        while (place >= bucket.lists[kind].count) place -= bucket.lists[kind++].count;
        AnyRecord record;
        RAYPAGER_TRY(bucket.read(static_cast<RecordKind>(kind), place, std::span(record).first(record_bytes[kind])));
        sample[i] = make_ref(static_cast<RecordKind>(kind), record.data());
        return {};
    };
    const auto take_some = [&](size_t begin, size_t end) -> Status {
        for (size_t i = begin; i < end; i++) RAYPAGER_TRY(take(i));
        return {};
    };
    RAYPAGER_TRY(parallel_try(count, 1024, take_some));
    return sample;
}

}  // namespace raypager
