// Judges policies on a recorded demand trace: every policy at every pool size, against what a clairvoyant could have done.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "bench/replay.hpp"
#include "raypager/device_profile.hpp"
#include "raypager/tuning.hpp"

namespace raypager::bench {

struct PolicyBenchSettings {
    std::vector<uint64_t> pools;  // bytes; raised to the largest block
    std::vector<PolicyKind> policies;
    uint64_t slots = 0;  // of the whole render; 0: as recorded
    uint32_t loads_in_flight = 0;
    std::optional<double> hold_above_ready;
    ProfileChanges tuning;  // of what suits the device of the recording
    double bandwidth = 0;   // bytes a second; 0: see ReplaySettings
    double ray_rate = 0;    // rays a second while all are resident; 0: as recorded
};

struct PolicyRow {
    PolicyKind policy = PolicyKind::aged_wants;
    uint64_t pool_bytes = 0;
    ReplayResult replay;       // without its service order
    uint64_t clairvoyant = 0;  // furthest_next_use_bytes of its order of service
    uint64_t least = 0;        // min_bytes of the pool
};

// The recorded render again, by its own settings: how far the replay is from what the engine did.
struct ReplayCheck {
    ReplayResult replay;
    double bytes_ratio = 0;  // replayed over measured; 0 if nothing was loaded
    double rounds_ratio = 0;
};

ReplayCheck check_replay(const DemandTrace& trace);
// Rows by pool, then by policy, as they were asked for. progress: of the whole, 0 to 1; may be empty, is called from several threads.
std::vector<PolicyRow> bench_policies(const DemandTrace& trace, const PolicyBenchSettings& settings, const std::function<void(double)>& progress);

}  // namespace raypager::bench
