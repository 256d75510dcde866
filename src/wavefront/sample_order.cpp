#include "wavefront/sample_order.hpp"

#include <algorithm>

namespace raypager {
namespace {

// Kernels number the samples of a group with 32 bits.
uint32_t most_numbered(uint64_t pixels) { return static_cast<uint32_t>(std::clamp<uint64_t>(UINT32_MAX / pixels, 1, most_together)); }

// So many of the grouped passes are done in one region after the other.
uint32_t stretch_passes(const rp_sample_order& order) {
    return order.region == 0 ? order.together : RP_STRETCH_PASSES / order.together * order.together;
}

// That regions of this order get, if it is to have some, before the next region's turn.
uint64_t passes_of_regions(rp_sample_order order) {
    order.region = 1;
    return std::min(stretch_passes(order), order.grouped_passes);
}

}  // namespace

rp_sample_order make_order(uint32_t tile_size, uint32_t together, uint32_t spp, uint64_t pixels, uint32_t region) {
    const uint32_t most = std::clamp<uint32_t>(together, 1, most_numbered(pixels)), groups = (spp + most - 1) / most;
    const uint32_t each = std::max<uint32_t>(1, spp / std::max<uint32_t>(groups, 1));
    return {tile_size, each, spp / each * each, region < pixels ? region : 0};
}

uint32_t default_together(uint64_t pixels) {
    // Rays of 16 samples lie so close together that more gain nothing (bench/results.md).
    constexpr uint64_t enough = 16, most_samples = uint64_t{1} << 25;
    return static_cast<uint32_t>(std::clamp<uint64_t>(most_samples / pixels, 1, enough));
}

uint64_t most_slots_with_regions(const rp_sample_order& order, uint64_t pixels) {
    return pixels / least_regions * passes_of_regions(order) / region_paths_per_slot;
}

uint32_t default_region(const rp_sample_order& order, uint64_t slots, uint64_t pixels) {
    if (slots > most_slots_with_regions(order, pixels)) return 0;
    const uint64_t passes = passes_of_regions(order);
    return static_cast<uint32_t>((region_paths_per_slot * slots + passes - 1) / passes);
}

EarlyEnd early_end(const rp_sample_order& order, uint64_t begun, uint64_t sample_limit, uint64_t pixels, bool keep_order) {
    const uint64_t begins = std::max<uint64_t>(begun, 1);  // a render that has not begun yet makes one pass
    const uint64_t stretch = std::min(stretch_passes(order), order.grouped_passes);
    const bool grouped = stretch > 1 && begins < order.grouped_passes * pixels;
    if (grouped && begins >= stretch * pixels) return {order, begun, std::min(sample_limit, begun)};
    if (grouped && !keep_order) {
        // Pixels before this place have all samples of the first stretch, or some. The others get their first one: a pass whose beginning has been.
        const uint64_t region = order.region ? order.region : pixels, first = begun / (region * stretch) * region;
        const uint64_t in_region = begun - first * stretch;
        const uint64_t place = std::min({first + (in_region + order.together - 1) / order.together, first + region, pixels});
        return {{order.tile_size, 1, 0, 0}, place, std::min(sample_limit, pixels)};
    }
    return {order, begun, std::min(sample_limit, passes_begun(order, begins, pixels) * pixels)};
}

rp_sample_order continue_order(rp_sample_order order, uint64_t begun, uint32_t spp, uint64_t pixels) {
    // Passes behind the groups come one by one; where none of them has begun yet, there can be as many groups as the new number allows. But regions
    // get as many passes as they would have got.
    const uint32_t stretch = stretch_passes(order);
    if (begun <= order.grouped_passes / stretch * stretch * pixels) order.grouped_passes = spp / order.together * order.together;
    return order;
}

bool valid_order(const rp_sample_order& order, uint64_t pixels) {
    return order.tile_size >= 1 && order.tile_size <= largest_tile && order.together >= 1 && order.together <= most_numbered(pixels) &&
           order.grouped_passes % order.together == 0;
}

uint64_t sample_number(const rp_sample_order& order, uint32_t width, uint32_t height, uint32_t pixel, uint32_t sample) {
    const uint64_t pixels = uint64_t{width} * height, place = place_in_tiles(pixel % width, pixel / width, width, height, order.tile_size);
    if (sample >= order.grouped_passes) return sample * pixels + place;
    const uint64_t stretch = stretch_passes(order), earlier = sample / stretch * stretch;
    const uint64_t passes = std::min(stretch, order.grouped_passes - earlier), in_stretch = sample - earlier, in_group = in_stretch % order.together;
    const uint64_t region = order.region ? order.region : pixels, first = place / region * region, size = std::min(region, pixels - first);
    return earlier * pixels + first * passes + (in_stretch - in_group) * size + (place - first) * order.together + in_group;
}

uint64_t passes_begun(const rp_sample_order& order, uint64_t next_sample, uint64_t pixels) {
    const auto passes = [&](uint64_t samples, uint64_t each) { return (samples / (each * pixels) + (samples % (each * pixels) != 0)) * each; };
    return next_sample <= order.grouped_passes * pixels ? std::min<uint64_t>(passes(next_sample, stretch_passes(order)), order.grouped_passes)
                                                        : passes(next_sample, 1);
}

uint64_t place_in_tiles(uint32_t x, uint32_t y, uint32_t width, uint32_t height, uint32_t tile_size) {
    const uint64_t band = y / tile_size, column = x / tile_size;
    const uint64_t tile_height = std::min<uint64_t>(tile_size, height - band * tile_size);
    const uint64_t tile_width = std::min<uint64_t>(tile_size, width - column * tile_size);
    return band * tile_size * width + column * tile_size * tile_height + y % tile_size * tile_width + x % tile_size;
}

}  // namespace raypager
