// In which order the samples of a picture are begun (abi/scene.h); kernels/lib/sample_order.cl has the inverse.
#pragma once

#include <cstdint>

#include "raypager/abi/scene.h"

namespace raypager {

inline constexpr uint32_t most_together = 64;  // passes of a group
inline constexpr uint32_t largest_tile = 1024;

// For so many samples a pixel, with groups of at most `together` passes: as many of equal size as there can be. region: as rp_sample_order has it.
rp_sample_order make_order(uint32_t tile_size, uint32_t together, uint32_t spp, uint64_t pixels, uint32_t region = 0);
// The size of groups for a picture of so many pixels, 1 to 16.
uint32_t default_together(uint64_t pixels);
// Regions of a render get so many paths for each path slot: far fewer, and most of the time their last paths wait while those of the next region
// already ask for other blocks; far more, and they meet more blocks than there is room for (bench/results.md). Where blocks are swapped, half of the
// slots are taken for it: the others wait.
inline constexpr uint64_t region_paths_per_slot = 3;
// Fewer regions are no gain.
inline constexpr uint64_t least_regions = 6;
// The most path slots for which such a render is long enough to have regions.
uint64_t most_slots_with_regions(const rp_sample_order& order, uint64_t pixels);
// The pixels of its regions then; 0: there are more slots.
uint32_t default_region(const rp_sample_order& order, uint64_t slots, uint64_t pixels);
// How a render ends before its time.
struct EarlyEnd {
    rp_sample_order order;  // in which it goes on
    uint64_t next_sample;   // its number in that order
    uint64_t sample_limit;  // as rp_render_params has it
};
// With the pass that is under way after the first `begun` samples; within a group at once, but every pixel gets a sample. keep_order: only so that
// another render can go on from there, which it cannot where a pass ends the first group; that group is ended then, or, with regions, the passes
// that all of them get in turn.
EarlyEnd early_end(const rp_sample_order& order, uint64_t begun, uint64_t sample_limit, uint64_t pixels, bool keep_order);
// The order in which a render with other samples a pixel goes on after the first `begun` samples of this one.
rp_sample_order continue_order(rp_sample_order order, uint64_t begun, uint32_t spp, uint64_t pixels);
// Whether there can be such an order; false for what a damaged file says.
bool valid_order(const rp_sample_order& order, uint64_t pixels);

// Where a sample comes in that order.
uint64_t sample_number(const rp_sample_order& order, uint32_t width, uint32_t height, uint32_t pixel, uint32_t sample);
// So many passes have begun when the samples before this one have: those of a group begin together, and with regions those done in turn.
uint64_t passes_begun(const rp_sample_order& order, uint64_t next_sample, uint64_t pixels);
// Where a pixel comes in a pass.
uint64_t place_in_tiles(uint32_t x, uint32_t y, uint32_t width, uint32_t height, uint32_t tile_size);

}  // namespace raypager
