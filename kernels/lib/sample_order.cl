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

// Sample `number` of the render, see rp_sample_order.
static inline rp_path_sample rp_numbered_sample(rp_sample_order order, uint width, uint height, ulong number) {
    const uint pixels = width * height;
    rp_path_sample result;
    uint place;
    if (number < (ulong)order.grouped_passes * pixels) {
        const uint stretch = order.region ? RP_STRETCH_PASSES / order.together * order.together : order.together;
        const uint region = order.region ? order.region : pixels;
        const uint earlier = (uint)rp_divide(number, (ulong)stretch * pixels) * stretch;  // passes before this stretch
        const uint passes = min(stretch, order.grouped_passes - earlier);
        number -= (ulong)earlier * pixels;
        const uint first = (uint)rp_divide(number, (ulong)region * passes) * region;  // place of the region
        number -= (ulong)first * passes;
        const uint group_size = min(region, pixels - first) * order.together;
        const uint group = (uint)rp_divide(number, group_size), in_group = (uint)(number - (ulong)group * group_size);
        const uint in_region = in_group / order.together;
        place = first + in_region;
        result.sample = earlier + group * order.together + (in_group - in_region * order.together);
    } else {
        result.sample = (uint)rp_divide(number, pixels);
        place = (uint)(number - (ulong)result.sample * pixels);
    }
    const uint2 xy = rp_tile_pixel(place, width, height, order.tile_size);
    result.pixel = xy.y * width + xy.x;
    return result;
}

#endif
