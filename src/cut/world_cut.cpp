#include "cut/world_cut.hpp"

#include <algorithm>
#include <numeric>

#include "base/group_places.hpp"
#include "base/jitter.hpp"
#include "base/parallel.hpp"
#include "base/reused_memory.hpp"
#include "cut/partition.hpp"

namespace raypager {
namespace {

// What one thread does at a time.
constexpr size_t piece_primitives = size_t{1} << 16;
// Up to so many primitives are a single region.
constexpr size_t small = size_t{1} << 16;
// One in so many is looked at for the cuts, within bounds; a region gets about so many of them, and each cut is found on about twice as many or more.
constexpr size_t sampled = 16, max_sample = size_t{1} << 22, sample_of_region = size_t{1} << 13;
static_assert(max_sample / sample_of_region <= UINT16_MAX);
// A ref, and what weighing takes where vertices are compared that triangles share.
constexpr uint64_t bytes_of_ref = sizeof(PrimitiveRef) + 40;

}  // namespace

WorldCut::WorldCut(const World& world, const Weigher& weigher) : world_(world), weigher_(weigher), sample_(take_sample()) {
    if (sample_.empty()) return;
    const double share = static_cast<double>(sample_.size()) / static_cast<double>(world.primitives.size());
    weight_ = static_cast<uint64_t>(static_cast<double>(weight_of(sample_)) / share);
}

PrimitiveRefs WorldCut::take_sample() const {
    const size_t all = world_.primitives.size(), count = std::min(all, std::clamp(all / sampled, small, max_sample));
    PrimitiveRefs sample(count);
    parallel_for(count, piece_primitives, [&](size_t first, size_t last) {
        for (size_t i = first; i < last; i++) sample[i] = make_ref(world_, static_cast<uint32_t>(one_of_stretch(i, count, all)));
        weigher_.guess(std::span(sample).subspan(first, last - first));
    });
    return sample;
}

std::vector<Part> WorldCut::sort_into_regions(uint64_t limit, UnwrittenVector<uint32_t>& order) {
    const size_t all = order.size();
    const double limit_of_sample = static_cast<double>(limit) * static_cast<double>(sample_.size()) / static_cast<double>(all);
    const size_t most = sample_.size() / sample_of_region;
    const Partition partition(std::move(sample_), limit_of_sample, most);
    const GroupPlaces places(all, partition.parts(), piece_primitives, [&](size_t i) {
        const auto primitive = static_cast<uint32_t>(i);
        return partition.part_of(primitive_bounds(world_, primitive), primitive);
    });
    std::vector<Part> result(partition.parts());
    for (size_t region = 0; region < result.size(); region++) {
        result[region].begin = places.begin(region);
        result[region].end = places.begin(region + 1);
    }
    places.put_all([&](size_t i, uint32_t place) { order[place] = static_cast<uint32_t>(i); });
    return result;
}

WorldParts WorldCut::run(uint64_t limit, uint64_t memory) && {
    const size_t all = world_.primitives.size();
    WorldParts result;
    result.order.resize(all);
    if (all <= small || weight_ <= limit) {
        PrimitiveRefs refs = std::move(sample_);
        std::iota(result.order.begin(), result.order.end(), 0);
        if (refs.size() != all) make_refs(world_, result.order, refs);
        result.parts = cut_region(refs, limit, result.order, 0);
        return result;
    }
    const std::vector<Part> regions = sort_into_regions(limit, result.order);
    size_t largest = 0;
    for (const Part& region : regions) largest = std::max(largest, region.end - region.begin);
    std::vector<std::vector<Part>> parts(regions.size());
    ReusedMemory<PrimitiveRefs> buffers;
    parallel_for(
        regions.size(), 1,
        [&](size_t region, size_t) {
            const auto [begin, end] = regions[region];
            PrimitiveRefs refs = buffers.take();
            const auto order = std::span(result.order).subspan(begin, end - begin);
            make_refs(world_, order, refs);
            parts[region] = cut_region(refs, limit, order, begin);
            buffers.give(std::move(refs));
        },
        std::max<uint64_t>(1, memory / (bytes_of_ref * largest)));
    for (const auto& of_region : parts) result.parts.insert(result.parts.end(), of_region.begin(), of_region.end());
    return result;
}

std::vector<Part> WorldCut::cut_region(std::span<PrimitiveRef> refs, uint64_t limit, std::span<uint32_t> order, size_t begin) const {
    weigher_.weigh(refs);
    std::vector<Part> parts = cut(refs, limit);
    for (Part& part : parts) part = {part.begin + begin, part.end + begin};
    for (size_t i = 0; i < refs.size(); i++) order[i] = refs[i].id;
    return parts;
}

}  // namespace raypager
