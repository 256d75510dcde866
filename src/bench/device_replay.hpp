// The rounds of one device on a recorded demand trace, without its clock: path slots, rays reduced to the blocks that they enter, and the page
// bookkeeping of the engine (BlockTable). Who owns it says which paths there are, and when the loads that the policy plans have come.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "raypager/abi/path.h"
#include "residency/block_table.hpp"
#include "residency/demand_trace.hpp"

namespace raypager::bench {

// Which blocks were entered in each round: those of round r (the first is 0) are blocks[begin[r]] .. blocks[begin[r + 1] - 1].
struct ServiceOrder {
    std::vector<uint32_t> blocks;
    std::vector<uint64_t> begin = {0};
};

struct DeviceReplaySettings {
    PolicySettings policy;
    uint64_t pool_bytes = 0;  // REQUIRES: at least the largest block
    uint64_t slab_bytes = 0;  // of a slab at most; 0: one slab
    uint32_t slots = 0;       // at least 1
    bool keeps_order = false;
};

class DeviceReplay {
public:
    // Of the trace's paths, the one that starts next; nothing if there are no more for this device.
    using NextPath = std::function<std::optional<uint64_t>()>;
    struct Round {
        uint32_t ready = 0;   // rays that could go on
        uint64_t visits = 0;  // of blocks, and starts of passes
    };

    // The trace outlives this.
    DeviceReplay(const DemandTrace& trace, const DeviceReplaySettings& settings, NextPath next_path);

    // Traces a round. Nothing: there is no more to do.
    std::optional<Round> start_round();
    // Rounds that the host has not seen yet.
    size_t under_way() const { return under_way_.size(); }
    // The host looks at the oldest of them. Then it may say what has come, and plan.
    void see_oldest();
    // Seen from the next round on that starts. REQUIRES: it was planned.
    void arrive(uint32_t block);
    // The loads that start now. Once after see_oldest().
    std::vector<PlannedLoad> plan();

    uint32_t rounds() const { return rounds_; }
    uint64_t rays() const { return rays_; }
    uint64_t visits() const { return visits_; }
    uint64_t longest_wait() const { return longest_wait_; }  // of a ray, in rounds
    const PagingStatistics& paging() const { return table_.statistics(); }
    ServiceOrder take_service() { return std::move(service_); }

private:
    // A path slot: the ray that it traces, and where that stands.
    struct Slot {
        uint64_t ray = 0, end = 0;
        uint32_t at = 0;  // the visit at which it waits
        uint32_t waits_since = 0;
    };
    // A round that the host has not seen yet.
    struct Unseen {
        uint32_t round, ready;
        std::vector<rp_block_demand> demand;
    };
    enum class Pass { ended, waits };

    rp_block_demand& demand(uint32_t block);
    std::vector<rp_block_demand> take_changes();
    void publish();
    void start_paths();
    void begin_ray(uint32_t slot, uint64_t ray, uint64_t end);
    void trace_ready_rays();
    void enter(uint32_t block);
    Pass extension_pass(Slot& slot);
    Pass shadow_pass(Slot& slot);

    const DemandTrace& trace_;
    const PolicyKind policy_;
    const uint32_t slot_count_;
    const bool keeps_order_;
    const NextPath next_path_;
    BlockTable table_;
    std::vector<Slot> slots_;
    std::vector<std::vector<uint32_t>> waiting_;  // slots, by block
    std::vector<rp_block_demand> demand_;         // by block; requests: see waiting_
    std::vector<uint32_t> changed_in_;            // by block: last round that changed it
    std::vector<uint32_t> told_;                  // blocks that the round tells of
    std::vector<uint32_t> free_, ready_, next_ready_, used_;
    std::vector<uint32_t> entered_in_;  // by block: last round with an entry
    std::vector<bool> seen_;            // by block: resident, as the rounds see it
    std::vector<uint32_t> changed_;     // blocks that came or went since the page table was published
    std::deque<Unseen> under_way_;
    Unseen oldest_ = {};  // that the host has seen last
    uint64_t waiting_rays_ = 0, rays_ = 0, visits_ = 0, longest_wait_ = 0;
    uint32_t round_ = 0, rounds_ = 0;
    bool paths_left_ = true;
    ServiceOrder service_;
};

}  // namespace raypager::bench
