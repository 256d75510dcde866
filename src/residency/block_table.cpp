#include "residency/block_table.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "raypager/abi/path.h"

namespace raypager {

BlockTable::BlockTable(std::span<const uint32_t> block_bytes, SlabAllocator pool, const PolicySettings& policy, bool keep_journal)
    : blocks_(block_bytes.size()), pool_(std::move(pool)), policy_(policy), keep_journal_(keep_journal) {
    for (size_t i = 0; i < blocks_.size(); i++) blocks_[i].bytes = block_bytes[i];
    // No more blocks can be on their way than fit into the pool.
    uint64_t smallest = UINT64_MAX;
    for (const uint32_t bytes : block_bytes) smallest = std::min<uint64_t>(smallest, bytes);
    const auto most = static_cast<uint32_t>(std::clamp<uint64_t>(pool_.capacity() / std::max<uint64_t>(1, smallest), 1, UINT32_MAX));
    policy_.loads_in_flight = std::min(policy_.loads_in_flight, most);
    policy_.loads_while_idle = std::min(policy_.loads_while_idle, most);
    policy_.loads_into_free = std::min(policy_.loads_into_free, most);
}

void BlockTable::take_demand(uint32_t round, std::span<const uint32_t> demand) {
    const size_t count = blocks_.size();
    RAYPAGER_CHECK(demand.size() >= RP_DEMAND_ARRAYS * count);
    for (size_t i = 0; i < count; i++) {
        BlockState& block = blocks_[i];
        block.requests = demand[RP_DEMAND_REQUESTS * count + i];
        block.bounces = demand[RP_DEMAND_BOUNCES * count + i];
        take_use(block, demand[RP_DEMAND_USED * count + i], round);
        if (block.requests == 0)
            block.requested_since = 0;
        else if (block.requested_since == 0)
            block.requested_since = round;
    }
}

void BlockTable::forget_demand() {
    for (BlockState& block : blocks_) block.requests = block.bounces = block.entries = block.requested_since = 0;
}

void BlockTable::take_use(BlockState& block, uint32_t use, uint32_t round) const {
    if (!counts_entries(policy_.kind)) {
        block.last_used = std::max(block.last_used, use);
        return;
    }
    const uint32_t entered = use - block.entries;
    block.entries = use;
    block.traffic = block.traffic * policy_.traffic_kept + entered;
    if (block.traffic < 1) block.traffic = 0;  // what has not been used for long is no better than what was not counted yet
    if (entered > 0) block.last_used = std::max(block.last_used, round);
}

void BlockTable::arrive(uint32_t round, uint32_t index) {
    BlockState& block = blocks_[index];
    RAYPAGER_CHECK(block.state == PageState::loading);
    block.state = PageState::resident;
    block.resident_since = round + 1;
    block.last_used = round + 1;
    statistics_.loads++;
    statistics_.bytes_loaded += block.bytes;
    if (keep_journal_) journal_.push_back({round, index, true});
}

void BlockTable::evict(uint32_t round, uint32_t index) {
    BlockState& block = blocks_[index];
    RAYPAGER_CHECK(block.state == PageState::resident);
    resident_bytes_ -= block.bytes;
    block.state = PageState::absent;
    block.requested_since = 0;
    statistics_.evictions++;
    if (keep_journal_) journal_.push_back({round, index, false});
}

void BlockTable::begin_load(const PlannedLoad& load) {
    BlockState& block = blocks_[load.block];
    RAYPAGER_CHECK(block.state == PageState::absent);
    block.state = PageState::loading;
    block.address = load.address;
    resident_bytes_ += block.bytes;
    RAYPAGER_CHECK(resident_bytes_ <= pool_.capacity());
    statistics_.peak_resident_bytes = std::max(statistics_.peak_resident_bytes, resident_bytes_);
    next_in_turn_ = static_cast<uint32_t>((load.block + 1) % blocks_.size());
}

Plan BlockTable::plan(uint32_t round, uint32_t ready_rays, uint32_t slots) {
    Plan plan = plan_paging(policy_, {blocks_, round, ready_rays, slots, next_in_turn_}, pool_);
    pool_ = std::move(plan.pool);
    for (const uint32_t block : plan.evict) evict(round, block);
    for (const PlannedLoad& load : plan.load) begin_load(load);
    return plan;
}

}  // namespace raypager
