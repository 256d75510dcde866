// What is known of every block (and page of images) between two rounds, and what follows from it: the device-free half of the residency. A render and
// the replay of a recorded one go through this same class.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "residency/policy.hpp"
#include "residency/slab_allocator.hpp"

namespace raypager {

struct PagingStatistics {
    uint64_t loads = 0, evictions = 0, bytes_loaded = 0, peak_resident_bytes = 0;
};

// A block came (rounds after `round` see it) or went.
struct PagingEvent {
    uint32_t round, block;
    bool came;
};

class BlockTable {
public:
    // block_bytes: of each block in device memory. keep_journal: remember every event.
    BlockTable(std::span<const uint32_t> block_bytes, SlabAllocator pool, const PolicySettings& policy, bool keep_journal = false);

    // Takes in the demand of the round that has ended: the arrays of abi/path.h (RP_DEMAND_*), one after the other.
    void take_demand(uint32_t round, std::span<const uint32_t> demand);
    // Nobody waits any more, and RP_DEMAND_USED counts from 0 again.
    void forget_demand();
    // A load has ended; rounds after this one see the block. REQUIRES: it was loading.
    void arrive(uint32_t round, uint32_t block);
    // Decides what goes and what comes, and counts it as done: evicted blocks are absent, planned ones are loading.
    Plan plan(uint32_t round, uint32_t ready_rays, uint32_t slots);

    std::span<const BlockState> blocks() const { return blocks_; }
    const PolicySettings& policy() const { return policy_; }
    const PagingStatistics& statistics() const { return statistics_; }
    const std::vector<PagingEvent>& journal() const { return journal_; }
    uint64_t resident_bytes() const { return resident_bytes_; }  // of what is resident or loading
    uint64_t pool_bytes() const { return pool_.capacity(); }

private:
    void take_use(BlockState& block, uint32_t use, uint32_t round) const;
    void evict(uint32_t round, uint32_t block);
    void begin_load(const PlannedLoad& load);

    std::vector<BlockState> blocks_;
    SlabAllocator pool_;
    PolicySettings policy_;
    PagingStatistics statistics_;
    uint64_t resident_bytes_ = 0;
    uint32_t next_in_turn_ = 0;
    bool keep_journal_;
    std::vector<PagingEvent> journal_;
};

}  // namespace raypager
