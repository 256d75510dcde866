#include "wavefront/sample_order.hpp"

#include <algorithm>

namespace raypager {
namespace {

// Kernels number the samples of a group with 32 bits.
uint32_t most_numbered(uint64_t pixels) { return static_cast<uint32_t>(std::clamp<uint64_t>(UINT32_MAX / pixels, 1, max_together)); }

// The part of the grouped passes that one lies in, and how many of them form a group there.
struct Stretch {
    uint64_t first, passes, together;
};

Stretch stretch_of(const rp_sample_order& order, uint64_t pass) {
    uint64_t end = order.grouped_passes, first = (end + RP_LAST_STRETCH - 1) / RP_LAST_STRETCH;
    for (; first > pass; first = (first + 1) / 2) end = first;
    const uint64_t passes = end - first, groups = (passes + order.together - 1) / order.together;
    return {first, passes, (passes + groups - 1) / groups};
}

bool is_grouped(const rp_sample_order& order, uint64_t pass) { return pass >= 1 && pass < order.grouped_passes; }

// Samples follow each other pass by pass, whatever grouped_passes says.
bool is_plain(const rp_sample_order& order) { return order.together == 1 && order.region == 0; }

// Of the last stretch, which is by far the longest.
uint64_t passes_of_regions(const rp_sample_order& order) {
    return order.grouped_passes < 2 ? order.grouped_passes : stretch_of(order, order.grouped_passes - 1).passes;
}

}  // namespace

rp_sample_order make_order(uint32_t tile_size, uint32_t together, uint32_t spp, uint64_t pixels, uint32_t region) {
    return {tile_size, std::clamp<uint32_t>(together, 1, most_numbered(pixels)), spp, region < pixels ? region : 0};
}

uint32_t default_together(uint64_t pixels) {
    // Rays of 16 samples lie so close together that more gain nothing (bench/journal/cpu-paging.md).
    constexpr uint64_t enough = 16, max_samples = uint64_t{1} << 25;
    return static_cast<uint32_t>(std::clamp<uint64_t>(max_samples / pixels, 1, enough));
}

uint64_t max_slots_with_regions(const rp_sample_order& order, uint64_t pixels) {
    return pixels / min_regions * passes_of_regions(order) / region_paths_per_slot;
}

uint32_t default_region(const rp_sample_order& order, uint64_t slots, uint64_t pixels) {
    if (slots > max_slots_with_regions(order, pixels)) return 0;
    const uint64_t passes = passes_of_regions(order);
    return static_cast<uint32_t>((region_paths_per_slot * slots + passes - 1) / passes);
}

uint64_t early_limit(const rp_sample_order& order, uint64_t begun, uint64_t sample_limit, uint64_t pixels, bool whole_passes) {
    if (begun < pixels) return std::min(sample_limit, pixels);
    if (!whole_passes || (!is_plain(order) && is_grouped(order, begun / pixels))) return std::min(sample_limit, begun);
    return std::min(sample_limit, (begun + pixels - 1) / pixels * pixels);
}

std::vector<rp_path_sample> coarse_samples(const rp_sample_order& order, uint64_t begun, uint32_t width, uint32_t height, uint64_t most) {
    constexpr uint32_t coarsest = 64;
    std::vector<rp_path_sample> samples;
    const uint32_t first_row = static_cast<uint32_t>(begun / width / order.tile_size * order.tile_size);  // those before it have begun
    for (uint32_t step = coarsest; step > 0; step /= 2)
        for (uint32_t y = (first_row + step - 1) / step * step; y < height; y += step)
            for (uint32_t x = 0; x < width; x += step) {
                if (samples.size() >= most) return samples;
                const bool before = step < coarsest && (x | y) % (2 * step) == 0;
                if (!before && place_in_tiles(x, y, width, height, order.tile_size) >= begun) samples.push_back({y * width + x, 0});
            }
    return samples;
}

rp_sample_order continue_order(rp_sample_order order, uint64_t begun, uint32_t spp, uint64_t pixels) {
    // Where the stretches begin follows from how many passes there are: that stays as it is once the second one has begun.
    if (begun <= pixels || is_plain(order)) order.grouped_passes = spp;
    return order;
}

bool valid_order(const rp_sample_order& order, uint64_t pixels) {
    return order.tile_size >= 1 && order.tile_size <= largest_tile && order.together >= 1 && order.together <= most_numbered(pixels) &&
           order.grouped_passes <= max_passes;
}

uint64_t sample_number(const rp_sample_order& order, uint32_t width, uint32_t height, uint32_t pixel, uint32_t sample) {
    const uint64_t pixels = uint64_t{width} * height, place = place_in_tiles(pixel % width, pixel / width, width, height, order.tile_size);
    if (!is_grouped(order, sample)) return sample * pixels + place;
    const Stretch stretch = stretch_of(order, sample);
    const uint64_t in_stretch = sample - stretch.first, group = in_stretch / stretch.together * stretch.together;
    const uint64_t together = std::min(stretch.together, stretch.passes - group);
    const uint64_t region = order.region ? order.region : pixels, first = place / region * region, size = std::min(region, pixels - first);
    return stretch.first * pixels + first * stretch.passes + group * size + (place - first) * together + (in_stretch - group);
}

std::vector<SampleRange> numbers_of_places(const rp_sample_order& order, uint64_t first, uint64_t end, uint64_t pixels, uint64_t limit) {
    std::vector<SampleRange> ranges;
    const auto add = [&](uint64_t begin, uint64_t count) {
        if (begin < limit) ranges.push_back({begin, std::min(begin + count, limit)});
    };
    const auto add_region = [&](const Stretch& stretch, uint64_t region, uint64_t size) {
        const uint64_t from = std::max(first, region), to = std::min(end, region + size), begin = stretch.first * pixels + region * stretch.passes;
        if (to - from == size) return add(begin, size * stretch.passes);
        for (uint64_t group = 0; group < stretch.passes; group += stretch.together) {
            const uint64_t together = std::min(stretch.together, stretch.passes - group);
            add(begin + group * size + (from - region) * together, (to - from) * together);
        }
    };
    const uint64_t region = order.region ? order.region : pixels;
    for (uint64_t pass = 0; pass * pixels < limit;) {
        if (!is_grouped(order, pass)) {
            add(pass++ * pixels + first, end - first);
            continue;
        }
        const Stretch stretch = stretch_of(order, pass);
        for (uint64_t at = first / region * region; at < end; at += region) add_region(stretch, at, std::min(region, pixels - at));
        pass = stretch.first + stretch.passes;
    }
    return merge_ranges(std::move(ranges));
}

uint64_t fewest_passes(const rp_sample_order& order, uint64_t next_sample, uint64_t pixels) {
    if (next_sample == 0) return 0;
    const uint64_t last = (next_sample - 1) / pixels;
    return is_plain(order) || !is_grouped(order, last) ? last + 1 : order.grouped_passes;
}

uint64_t place_in_tiles(uint32_t x, uint32_t y, uint32_t width, uint32_t height, uint32_t tile_size) {
    const uint64_t band = y / tile_size, column = x / tile_size;
    const uint64_t tile_height = std::min<uint64_t>(tile_size, height - band * tile_size);
    const uint64_t tile_width = std::min<uint64_t>(tile_size, width - column * tile_size);
    return band * tile_size * width + column * tile_size * tile_height + y % tile_size * tile_width + x % tile_size;
}

}  // namespace raypager
