// Puts the events of the visit log (abi/visits.h) together again: by path, in the order of rays.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "residency/demand_trace.hpp"

namespace raypager {

class VisitRecorder {
public:
    // Of a picture of width x height whose camera paths start in tiles (kernels/stages/generate.cl).
    VisitRecorder(uint32_t width, uint32_t height, uint32_t tile_size) : width_(width), height_(height), tile_size_(tile_size) {}
    // The events of one round: RP_VISIT_WORDS words each.
    void take(std::span<const uint32_t> events);
    // All paths, in the order in which they started. Fills path_rays, rays and visits; leaves the recorder empty.
    void finish(DemandTrace& trace);
    size_t path_count() const { return paths_.size(); }

private:
    struct Path {
        uint64_t number;               // in the order of generation: pass by pass, tile by tile
        std::vector<uint32_t> events;  // kind | block
    };
    uint64_t number_of(uint32_t pixel, uint32_t sample) const;

    uint32_t width_, height_, tile_size_;
    std::unordered_map<uint64_t, uint32_t> index_;  // pixel and sample -> place in paths_
    std::vector<Path> paths_;
};

// Where a pixel comes in a pass that goes through the picture in tiles: the inverse of rp_tile_pixel.
uint64_t place_in_tiles(uint32_t x, uint32_t y, uint32_t width, uint32_t height, uint32_t tile_size);

}  // namespace raypager
