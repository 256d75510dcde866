// Serves a recorded demand trace again, under any pool and policy, without a device and in seconds: the rounds of the engine (wake,
// generate, extend, connect), its slots and its page bookkeeping (BlockTable, plan_paging), with rays reduced to the blocks that they enter.
//
// What is exact: the order of each ray's visits (with --traversal ray), where it waits, and every decision of the policy, given which loads
// have arrived by the end of a round; but for shadow rays that come by the block that stops them more than once, through several of its
// sub-boxes: a trace marks blocks, so these end at the first of its visits. What is a model: time. A round takes as long as its visits cost;
// transfers follow one another at a given bandwidth. A trace that holds a share s of a render's paths is served with s times its slots: as many
// generations of paths, each want 1/s rays, so that bytes, loads and rounds come out as those of the whole render, as long as some rays remain for
// each block (slots well above blocks).
#pragma once

#include <cstdint>
#include <vector>

#include "bench/device_replay.hpp"
#include "residency/demand_trace.hpp"
#include "residency/policy.hpp"

namespace raypager::bench {

struct ReplaySettings {
    PolicySettings policy;
    uint64_t pool_bytes = 0;  // REQUIRES: at least the largest block
    uint64_t slab_bytes = 0;  // of a slab at most; 0: one slab
    uint32_t slots = 0;       // for the paths of the trace, that is already times its share; at least 1
    bool wait_for_loads = false;
    uint32_t rounds_under_way = 1;  // 2: a round starts before the host has seen what the one before it did, as on a GPU
    double visit_seconds = 0;       // that one visit or the start of a pass of a ray takes
    double round_seconds = 0;       // that a round takes beside
    double bandwidth = 0;           // bytes a second; 0: what was asked for after one round is there after the next
};

struct ReplayResult {
    uint64_t loads = 0, evictions = 0, bytes_loaded = 0, peak_resident_bytes = 0;
    uint64_t rounds = 0, rays = 0, visits = 0;
    uint64_t longest_wait = 0;      // of a ray, in rounds
    double seconds = 0, stall = 0;  // by the model; stall: of these, with no ray that could go on
    ServiceOrder service;
};

ReplayResult replay(const DemandTrace& trace, const ReplaySettings& settings);

// The settings under which the trace was recorded, with the visit cost that the recorded render had.
ReplaySettings recorded_settings(const DemandTrace& trace);
// Of all paths in flight, those that are for the paths in the trace.
uint32_t slots_of_share(const DemandTrace& trace, uint64_t slots);

}  // namespace raypager::bench
