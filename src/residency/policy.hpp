// Which blocks come in and which go out: a pure function of the demand, what is resident, and the space there is. No device, no clock,
// no disk; the same input gives the same plan.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/index_set.hpp"
#include "raypager/device_profile.hpp"
#include "raypager/tuning.hpp"
#include "residency/slab_allocator.hpp"

namespace raypager {

enum class PageState : uint8_t { absent, loading, resident };

// What is known of one block when a round has ended.
struct BlockState {
    PageState state = PageState::absent;
    uint32_t bytes = 0;
    uint32_t requests = 0;         // rays that wait for it now
    uint32_t bounces = 0;          // rays of the last round that ended on its surfaces
    uint32_t last_used = 0;        // last round in which a ray entered it, as far as that is noted
    uint32_t entries = 0;          // of rays so far, as counted (counts_entries)
    double traffic = 0;            // entries, as counted, of the last rounds: of earlier ones less and less (PolicySettings::traffic_kept)
    uint32_t requested_since = 0;  // first round of the present run of rounds in which it was wanted; 0: not wanted
    uint32_t resident_since = 0;   // first round that could see it
    PoolAddress address;
};

// What RP_DEMAND_USED is to be for a policy (abi/path.h): entries, or the last round with one.
bool counts_entries(PolicyKind kind);

struct PolicySettings {
    PolicyKind kind = PolicyKind::aged_wants;
    uint32_t loads_in_flight = 2;   // while blocks must be evicted for them
    uint32_t loads_while_idle = 0;  // the same while hardly any ray is ready, if that is more: then loads are all that is waited for
    uint32_t loads_into_free = 8;   // while there is free space
    uint32_t evict_ahead = 0;       // so many of those that are wanted next are to find free space: they need not wait for rounds under way
    double hold_above_ready = 0.4;  // no load that evicts starts while more than this share of the slots is ready; 1: never held back
    double traffic_kept = 0;        // share of what BlockState::traffic was before a round that it is after one
    uint32_t max_age = 0;           // rounds after which the longest wanted block comes first whatever the policy says; 0: never
};
PolicySettings default_settings(PolicyKind kind);
// The same for a pool and blocks of these sizes. Each round has a cost of its own, so small blocks come several at a time; but no more
// than a part of the pool (two are always allowed), for what is on its way serves no ray yet. The profile says how many suit the device. The paper's
// policy swaps one block a round.
PolicySettings default_settings(PolicyKind kind, uint64_t pool_bytes, uint64_t average_block_bytes, const DeviceProfile& profile);

// Which blocks there is something to decide about. Where there are very many, most are none of these.
struct ActiveBlocks {
    IndexSet wanted, resident;  // those that rays wait for, whatever their state
    uint32_t loading = 0;
    ActiveBlocks() = default;
    explicit ActiveBlocks(std::span<const BlockState> blocks);  // by looking at all
};

struct PolicyInput {
    std::span<const BlockState> blocks;
    const ActiveBlocks& active;  // of these
    uint32_t round = 0;          // that has ended
    uint32_t ready_rays = 0;     // that could go on in that round
    uint32_t slots = 0;
    uint32_t next_in_turn = 0;  // block behind the one whose load was started last; only PolicyKind::sweep looks at it
};

struct PlannedLoad {
    uint32_t block;
    PoolAddress address;
    bool was_free = false;  // the place was free before this plan
};

struct Plan {
    std::vector<uint32_t> evict;    // these first
    std::vector<PlannedLoad> load;  // into these places
    std::vector<uint32_t> behind;   // what is wanted beside, 512 blocks at most: the next one, then the others, roughly in order
    SlabAllocator pool;             // as it is then
};

// Never evicts a block that no round has seen yet, nor one that is being loaded. If anything is wanted, nothing is being loaded, and
// everything resident has been seen by a round, then the plan has a load (REQUIRES: every block fits into an empty pool).
// Looks at active blocks alone, unless the policy is PolicyKind::sweep and something is wanted.
Plan plan_paging(const PolicySettings& settings, const PolicyInput& input, SlabAllocator pool);

}  // namespace raypager
