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

// Sample `number` of the render, see rp_sample_order.
static inline rp_path_sample rp_numbered_sample(rp_sample_order order, uint width, uint height, ulong number) {
    const uint pixels = width * height, together = number < (ulong)order.grouped_passes * pixels ? order.together : 1u;
    const ulong group_size = (ulong)pixels * together, group = number / group_size;
    const uint in_group = (uint)(number - group * group_size), place = in_group / together;
    rp_path_sample result;
    result.sample = (uint)group * together + (in_group - place * together);
    const uint2 xy = rp_tile_pixel(place, width, height, order.tile_size);
    result.pixel = xy.y * width + xy.x;
    return result;
}

#endif
