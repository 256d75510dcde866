// Puts the events of the visit log (abi/visits.h) together again: by path, in the order of rays.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "raypager/abi/scene.h"
#include "residency/demand_trace.hpp"

namespace raypager {

class VisitRecorder {
public:
    // Of a picture of width x height.
    VisitRecorder(uint32_t width, uint32_t height, const rp_sample_order& order) : width_(width), height_(height), order_(order) {}
    // The events of one round: RP_VISIT_WORDS words each.
    void take(std::span<const uint32_t> events);
    // All paths, in the order in which they started. Fills path_rays, rays and visits; leaves the recorder empty.
    void finish(DemandTrace& trace);
    size_t path_count() const { return paths_.size(); }

private:
    struct Path {
        uint64_t number;               // sample_number
        std::vector<uint32_t> events;  // kind | block
    };

    uint32_t width_, height_;
    rp_sample_order order_;
    std::unordered_map<uint64_t, uint32_t> index_;  // pixel and sample -> place in paths_
    std::vector<Path> paths_;
};

}  // namespace raypager
