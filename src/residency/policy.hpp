// Which blocks come in and which go out: a pure function of the demand, what is resident, and the space there is. No device, no clock,
// no disk; the same input gives the same plan.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raypager/device_profile.hpp"
#include "raypager/tuning.hpp"
#include "residency/block_state.hpp"
#include "residency/slab_allocator.hpp"

namespace raypager {

// What RP_DEMAND_USED is to be for a policy (abi/path.h): entries, or the last round with one.
bool counts_entries(PolicyKind kind);
// Whether the policy tells a resident block from others of this kind by when it was used last alone: such go before those that are not idle. Bounces
// are counted for most-wanted alone.
bool is_idle(PolicyKind kind, const BlockState& block);

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

struct PolicyInput {
    std::span<const BlockState> blocks;
    const ActiveBlocks& active;  // of these
    uint32_t round = 0;          // that has ended
    uint32_t ready_rays = 0;     // that could go on in that round
    uint32_t slots = 0;
    uint32_t next_in_turn = 0;  // block behind the one whose load was started last; only PolicyKind::sweep looks at it
};

// How many blocks come before this one in the sweep's turn.
uint32_t turns_away(const PolicyInput& input, uint32_t block);

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
// Looks at those blocks alone that are wanted, and at resident ones only where what is idle does not make room; sweep at all if anything is wanted.
Plan plan_paging(const PolicySettings& settings, const PolicyInput& input, SlabAllocator pool);

}  // namespace raypager
