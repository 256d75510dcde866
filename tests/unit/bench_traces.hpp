// Random demand traces for the tests of files, replays and bounds.
#pragma once

#include <algorithm>
#include <random>

#include "raypager/abi/types.h"
#include "residency/demand_trace.hpp"

namespace raypager {

struct TraceShape {
    uint32_t blocks = 12, paths = 400, max_rays = 6, max_visits = 5;
    bool equal_sizes = false;
};

inline DemandTrace random_trace(uint64_t seed, const TraceShape& shape = {}) {
    std::mt19937_64 random(seed);
    const auto below = [&](uint64_t n) { return static_cast<uint32_t>(random() % n); };
    DemandTrace trace;
    for (uint32_t i = 0; i < shape.blocks; i++) trace.block_bytes.push_back(shape.equal_sizes ? 640 : 64 * (1 + below(20)));
    for (uint32_t path = 0; path < shape.paths; path++) {
        bool shadow = false;
        for (uint32_t ray = 1 + below(shape.max_rays); ray > 0; ray--) {
            TracedRay traced{trace.visits.size(), 0, shadow, RP_NONE};
            uint32_t block = below(shape.blocks);
            for (uint32_t visits = below(shape.max_visits + 1); visits > 0; visits--) {
                trace.visits.push_back(Visit::of(block, shadow && below(4) == 0));
                block = (block + 1 + below(std::min(3u, shape.blocks - 1))) % shape.blocks;  // never the same twice in a row
            }
            traced.visits = static_cast<uint32_t>(trace.visits.size() - traced.first_visit);
            if (!shadow && traced.visits) traced.hit_block = trace.visits.back().block();
            trace.rays.push_back(traced);
            shadow = !shadow && below(2) == 0;  // two shadow rays never follow each other
        }
        trace.path_rays.push_back(trace.rays.size());
    }
    RecordedRender& recorded = trace.recorded;
    recorded.device = "test device";
    recorded.pool_bytes = trace.geometry_bytes() / 2;
    recorded.slab_bytes = recorded.pool_bytes;
    recorded.slots = 50;
    recorded.paths = shape.paths;
    recorded.rays = trace.rays.size();
    recorded.loads = 3, recorded.bytes_loaded = 5, recorded.rounds = 7;
    recorded.seconds = 2.5, recorded.trace_seconds = 1.25;
    recorded.scene_identity = 0x123456789abcdefull;
    return trace;
}

}  // namespace raypager
