// In which order samples are begun (abi/scene.h); src/wavefront/sample_order.cpp has the inverse.
#ifndef RP_SAMPLE_ORDER_CL
#define RP_SAMPLE_ORDER_CL

#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"

// Pixel at place `i` of a pass: tiles of tile x tile pixels, row by row, and rows of pixels within a tile.
static inline uint2 rp_tile_pixel(uint i, uint width, uint height, uint tile) {
    const uint band = i / (width * tile), in_band = i - band * width * tile;
    const uint tile_height = min(tile, height - band * tile);
    const uint column = in_band / (tile * tile_height), in_tile = in_band - column * tile * tile_height;
    const uint tile_width = min(tile, width - column * tile);
    return (uint2)(column * tile + in_tile % tile_width, band * tile + in_tile / tile_width);
}

// Division of 64 bits takes several times as long as that of 32, and is rarely needed here.
static inline ulong rp_divide(ulong a, ulong b) { return (a | b) >> 32 ? a / b : (uint)a / (uint)b; }

// Samples that follow each other: those of a region in a stretch of passes, or of one pass of the whole picture.
typedef struct rp_sample_region {
    ulong begin, count;      // numbers
    uint first_place, size;  // in pixels
    uint first_sample, passes, together;
} rp_sample_region;

static inline rp_sample_region rp_region_of(rp_sample_order order, uint pixels, ulong number) {
    rp_sample_region r;
    const ulong pass = rp_divide(number, pixels);
    if (pass == 0ul || pass >= order.grouped_passes) {
        r.first_sample = (uint)pass;
        r.begin = pass * pixels;
        r.count = pixels;
        r.first_place = 0u;
        r.size = pixels;
        r.passes = 1u;
        r.together = 1u;
        return r;
    }
    uint end = order.grouped_passes, first = (end + RP_LAST_STRETCH - 1u) / RP_LAST_STRETCH;
    for (; first > (uint)pass; first = (first + 1u) / 2u) end = first;
    r.first_sample = first;
    r.passes = end - r.first_sample;
    const uint groups = (r.passes + order.together - 1u) / order.together;
    r.together = (r.passes + groups - 1u) / groups;
    const uint region = order.region ? order.region : pixels;
    r.begin = (ulong)r.first_sample * pixels;
    r.first_place = (uint)rp_divide(number - r.begin, (ulong)region * r.passes) * region;
    r.size = min(region, pixels - r.first_place);
    r.begin += (ulong)r.first_place * r.passes;
    r.count = (ulong)r.size * r.passes;
    return r;
}

// Sample `number` of the render, see rp_sample_order. region: that of a sample before it, mostly the same; count 0: none.
static inline rp_path_sample rp_numbered_sample(rp_sample_order order, uint width, uint height, ulong number, rp_sample_region* region) {
    if (number - region->begin >= region->count) *region = rp_region_of(order, width * height, number);
    const ulong in_region = number - region->begin;
    const uint group_size = region->size * region->together, group = (uint)rp_divide(in_region, group_size);
    // The last group of a stretch may be smaller.
    const uint earlier = group * region->together, together = min(region->together, region->passes - earlier);
    const uint in_group = (uint)(in_region - (ulong)group * group_size), place = in_group / together;
    rp_path_sample result;
    result.sample = region->first_sample + earlier + (in_group - place * together);
    const uint2 xy = rp_tile_pixel(region->first_place + place, width, height, order.tile_size);
    result.pixel = xy.y * width + xy.x;
    return result;
}

#endif
