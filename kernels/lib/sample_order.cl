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
    ulong begin, count;  // numbers
    uint first_place, size;  // in pixels
    uint first_sample, together;
} rp_sample_region;

static inline rp_sample_region rp_region_of(rp_sample_order order, uint pixels, ulong number) {
    rp_sample_region r;
    if (number >= (ulong)order.grouped_passes * pixels) {
        r.first_sample = (uint)rp_divide(number, pixels);
        r.begin = (ulong)r.first_sample * pixels;
        r.count = pixels;
        r.first_place = 0u;
        r.size = pixels;
        r.together = 1u;
        return r;
    }
    const uint stretch = order.region ? RP_STRETCH_PASSES / order.together * order.together : order.together;
    const uint region = order.region ? order.region : pixels;
    r.first_sample = (uint)rp_divide(number, (ulong)stretch * pixels) * stretch;
    const uint passes = min(stretch, order.grouped_passes - r.first_sample);
    r.begin = (ulong)r.first_sample * pixels;
    r.first_place = (uint)rp_divide(number - r.begin, (ulong)region * passes) * region;
    r.size = min(region, pixels - r.first_place);
    r.begin += (ulong)r.first_place * passes;
    r.count = (ulong)r.size * passes;
    r.together = order.together;
    return r;
}

// Sample `number` of the render, see rp_sample_order. region: that of a sample before it, mostly the same; count 0: none.
static inline rp_path_sample rp_numbered_sample(rp_sample_order order, uint width, uint height, ulong number, rp_sample_region* region) {
    if (number - region->begin >= region->count) *region = rp_region_of(order, width * height, number);
    const ulong in_region = number - region->begin;
    const uint group_size = region->size * region->together, group = (uint)rp_divide(in_region, group_size);
    const uint in_group = (uint)(in_region - (ulong)group * group_size), place = in_group / region->together;
    rp_path_sample result;
    result.sample = region->first_sample + group * region->together + (in_group - place * region->together);
    const uint2 xy = rp_tile_pixel(region->first_place + place, width, height, order.tile_size);
    result.pixel = xy.y * width + xy.x;
    return result;
}

#endif
