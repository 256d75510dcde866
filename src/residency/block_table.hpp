// What is known of every block (and page of images) between two rounds, and what follows from it: the device-free half of the residency. A render and
// the replay of a recorded one go through this same class. What it does after a round takes time by the blocks that are wanted, resident or used.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raypager/abi/path.h"
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

    // Takes in what the round that has ended tells of blocks: each once at most. Of the others requests and use are as they were, and there were no
    // bounces.
    void take_demand(uint32_t round, std::span<const rp_block_demand> demand);
    // Nobody waits any more, and RP_DEMAND_USED counts from 0 again.
    void forget_demand();
    // A load has ended; rounds after this one see the block. REQUIRES: it was loading.
    void arrive(uint32_t round, uint32_t block);
    // Decides what goes and what comes, and counts it as done: evicted blocks are absent, planned ones are loading.
    Plan plan(uint32_t round, uint32_t ready_rays, uint32_t slots);

    std::span<const BlockState> blocks() const { return blocks_; }
    const ActiveBlocks& active() const { return active_; }
    const PolicySettings& policy() const { return policy_; }
    const PagingStatistics& statistics() const { return statistics_; }
    const std::vector<PagingEvent>& journal() const { return journal_; }
    uint64_t resident_bytes() const { return resident_bytes_; }  // of what is resident or loading
    uint64_t pool_bytes() const { return pool_.capacity(); }

private:
    void take_requests(uint32_t index, uint32_t requests, uint32_t round);
    void take_use(uint32_t index, uint32_t use, uint32_t round);
    void fade_traffic();
    void note_rest(uint32_t index);
    void evict(uint32_t round, uint32_t block);
    void begin_load(const PlannedLoad& load);

    std::vector<BlockState> blocks_;
    ActiveBlocks active_;
    IndexSet with_traffic_;          // BlockState::traffic is not 0
    std::vector<uint32_t> faded_;    // of these: less than 1 is left, unless the round adds to it
    std::vector<uint32_t> bounced_;  // BlockState::bounces is not 0
    SlabAllocator pool_;
    PolicySettings policy_;
    PagingStatistics statistics_;
    uint64_t resident_bytes_ = 0;
    uint32_t next_in_turn_ = 0;
    bool keep_journal_;
    std::vector<PagingEvent> journal_;
};

}  // namespace raypager
