// In which order the samples of a picture are begun (abi/scene.h); kernels/lib/sample_order.cl has the inverse.
#pragma once

#include <cstdint>

#include "raypager/abi/scene.h"

namespace raypager {

inline constexpr uint32_t most_together = 64;  // passes of a group
inline constexpr uint32_t largest_tile = 1024;

// For so many samples a pixel, with groups of at most `together` passes: as many of equal size as there can be.
rp_sample_order make_order(uint32_t tile_size, uint32_t together, uint32_t spp, uint64_t pixels);
// The size of groups for a picture of so many pixels, 1 to 16.
uint32_t default_together(uint64_t pixels);
// How a render ends before its time.
struct EarlyEnd {
    rp_sample_order order;  // in which it goes on
    uint64_t next_sample;   // its number in that order
    uint64_t sample_limit;  // as rp_render_params has it
};
// With the pass that is under way after the first `begun` samples; within a group at once, but every pixel gets a sample. keep_order: only so that
// another render can go on from there, which it cannot where a pass ends the first group; that group is ended then.
EarlyEnd early_end(const rp_sample_order& order, uint64_t begun, uint64_t sample_limit, uint64_t pixels, bool keep_order);
// The order in which a render with other samples a pixel goes on after the first `begun` samples of this one.
rp_sample_order continue_order(rp_sample_order order, uint64_t begun, uint32_t spp, uint64_t pixels);
// Whether there can be such an order; false for what a damaged file says.
bool valid_order(const rp_sample_order& order, uint64_t pixels);

// Where a sample comes in that order.
uint64_t sample_number(const rp_sample_order& order, uint32_t width, uint32_t height, uint32_t pixel, uint32_t sample);
// So many passes have begun when the samples before this one have: those of a group begin together.
uint64_t passes_begun(const rp_sample_order& order, uint64_t next_sample, uint64_t pixels);
// Where a pixel comes in a pass.
uint64_t place_in_tiles(uint32_t x, uint32_t y, uint32_t width, uint32_t height, uint32_t tile_size);

}  // namespace raypager
