// In which order the samples of a picture are begun (abi/scene.h); kernels/common/sample_order.cl has the inverse.
#pragma once

#include <cstdint>
#include <vector>

#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"
#include "wavefront/sample_numbers.hpp"

namespace raypager {

inline constexpr uint32_t max_together = 64;  // passes of a group
inline constexpr uint32_t largest_tile = 1024;
inline constexpr uint32_t max_passes = 65535;  // what a pixel of the film holds (abi/film.h)

// For so many samples per pixel, with groups of at most `together` passes. region: as rp_sample_order has it.
inline constexpr uint32_t default_tile = 16;
rp_sample_order make_order(uint32_t tile_size, uint32_t together, uint32_t spp, uint64_t pixels, uint32_t region = 0);
// The size of groups for a picture of so many pixels, 1 to 16.
uint32_t default_together(uint64_t pixels);
// Regions of a render get so many paths for each path slot: far fewer, and most of the time their last paths wait while those of the next region
// already ask for other blocks; far more, and they meet more blocks than there is room for (bench/journal/cpu-paging.md). Where blocks
// are swapped, half of the slots are taken for it: the others wait.
inline constexpr uint64_t region_paths_per_slot = 3;
// Fewer regions are no gain.
inline constexpr uint64_t min_regions = 6;
// The most path slots for which such a render is long enough to have regions.
uint64_t max_slots_with_regions(const rp_sample_order& order, uint64_t pixels);
// The pixels of its regions then; 0: there are more slots.
uint32_t default_region(const rp_sample_order& order, uint64_t slots, uint64_t pixels);
// Where a render ends before its time, after the first `begun` samples: at once, but every pixel gets a sample. whole_passes: where samples are begun
// pass by pass, the last one is completed, too.
uint64_t early_limit(const rp_sample_order& order, uint64_t begun, uint64_t sample_limit, uint64_t pixels, bool whole_passes);
// Samples for the pixels that have none when the first pass ends after `begun` of them, for lack of time: first of points that are far apart all over
// the picture, then of those between, `most` at most.
std::vector<rp_path_sample> coarse_samples(const rp_sample_order& order, uint64_t begun, uint32_t width, uint32_t height, uint64_t most);
// The order in which a render with another number of samples per pixel goes on after the first `begun` samples of this one.
rp_sample_order continue_order(rp_sample_order order, uint64_t begun, uint32_t spp, uint64_t pixels);
// Whether there can be such an order; false for what a damaged file says.
bool valid_order(const rp_sample_order& order, uint64_t pixels);

// Where a sample comes in that order.
uint64_t sample_number(const rp_sample_order& order, uint32_t width, uint32_t height, uint32_t pixel, uint32_t sample);
// The numbers below `limit` of the samples of pixels first <= place_in_tiles < end, sorted.
std::vector<SampleRange> numbers_of_places(const rp_sample_order& order, uint64_t first, uint64_t end, uint64_t pixels, uint64_t limit);
// The fewest samples per pixel that a render can have whose first `next_sample` samples have begun: as many as some pixel has, or all that its order
// divides into stretches.
uint64_t fewest_passes(const rp_sample_order& order, uint64_t next_sample, uint64_t pixels);
// Where a pixel comes in a pass.
uint64_t place_in_tiles(uint32_t x, uint32_t y, uint32_t width, uint32_t height, uint32_t tile_size);

}  // namespace raypager
