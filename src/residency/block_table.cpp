#include "residency/block_table.hpp"

#include <algorithm>
#include <utility>

#include "base/check.hpp"

namespace raypager {

BlockTable::BlockTable(std::span<const uint32_t> block_bytes, SlabAllocator pool, const PolicySettings& policy, bool keep_journal)
    : blocks_(block_bytes.size()), with_traffic_(block_bytes.size()), pool_(std::move(pool)), policy_(policy), keep_journal_(keep_journal) {
    for (size_t i = 0; i < blocks_.size(); i++) blocks_[i].bytes = block_bytes[i];
    active_ = ActiveBlocks(blocks_);
    // No more blocks can be on their way than fit into the pool.
    uint64_t smallest = UINT64_MAX;
    for (const uint32_t bytes : block_bytes) smallest = std::min<uint64_t>(smallest, bytes);
    const auto most = static_cast<uint32_t>(std::clamp<uint64_t>(pool_.capacity() / std::max<uint64_t>(1, smallest), 1, UINT32_MAX));
    policy_.loads_in_flight = std::min(policy_.loads_in_flight, most);
    policy_.loads_while_idle = std::min(policy_.loads_while_idle, most);
    policy_.loads_into_free = std::min(policy_.loads_into_free, most);
}

void BlockTable::take_demand(uint32_t round, std::span<const rp_block_demand> demand) {
    const std::vector<uint32_t> bounced = std::exchange(bounced_, {});
    for (const uint32_t index : bounced) blocks_[index].bounces = 0;
    fade_traffic();
    for (const rp_block_demand& told : demand) {
        RAYPAGER_CHECK(told.block < blocks_.size());
        take_requests(told.block, told.requests, round);
        blocks_[told.block].bounces = told.bounces;
        if (told.bounces > 0) bounced_.push_back(told.block);
        take_use(told.block, told.used, round);
    }
    for (const uint32_t index : faded_) {
        if (blocks_[index].traffic >= 1) continue;
        blocks_[index].traffic = 0;  // what has not been used for long is no better than what was not counted yet
        with_traffic_.erase(index);
        note_rest(index);
    }
    faded_.clear();
    for (const uint32_t index : bounced) note_rest(index);
    active_.tidy(blocks_);
}

// Where a resident block may have become idle, or has been used and is idle all the same.
void BlockTable::note_rest(uint32_t index) {
    const BlockState& block = blocks_[index];
    if (block.state == PageState::resident && is_idle(policy_.kind, block)) active_.add_resting(index, block.last_used);
}

void BlockTable::forget_demand() {
    for (BlockState& block : blocks_) block.requests = block.bounces = block.entries = block.requested_since = 0;
    active_.wanted.clear();
    for (const uint32_t index : std::exchange(bounced_, {})) note_rest(index);
}

void BlockTable::take_requests(uint32_t index, uint32_t requests, uint32_t round) {
    BlockState& block = blocks_[index];
    block.requests = requests;
    active_.wanted.set(index, requests > 0);
    if (requests == 0)
        block.requested_since = 0;
    else if (block.requested_since == 0)
        block.requested_since = round;
}

void BlockTable::fade_traffic() {
    with_traffic_.for_each([this](uint32_t index) {
        blocks_[index].traffic *= policy_.traffic_kept;
        if (blocks_[index].traffic < 1) faded_.push_back(index);
    });
}

void BlockTable::take_use(uint32_t index, uint32_t use, uint32_t round) {
    BlockState& block = blocks_[index];
    if (!counts_entries(policy_.kind)) {
        if (use <= block.last_used) return;
        block.last_used = use;
        note_rest(index);
        return;
    }
    const uint32_t entered = use - block.entries;
    if (entered == 0) return;
    block.entries = use;
    block.traffic += entered;
    block.last_used = std::max(block.last_used, round);
    with_traffic_.insert(index);
}

void BlockTable::arrive(uint32_t round, uint32_t index) {
    BlockState& block = blocks_[index];
    RAYPAGER_CHECK(block.state == PageState::loading);
    block.state = PageState::resident;
    active_.resident.insert(index);
    active_.loading--;
    block.resident_since = round + 1;
    block.last_used = round + 1;
    note_rest(index);
    statistics_.loads++;
    statistics_.bytes_loaded += block.bytes;
    if (keep_journal_) journal_.push_back({round, index, true});
}

void BlockTable::evict(uint32_t round, uint32_t index) {
    BlockState& block = blocks_[index];
    RAYPAGER_CHECK(block.state == PageState::resident);
    resident_bytes_ -= block.bytes;
    block.state = PageState::absent;
    active_.resident.erase(index);
    block.requested_since = block.requests > 0 ? round + 1 : 0;
    statistics_.evictions++;
    if (keep_journal_) journal_.push_back({round, index, false});
}

void BlockTable::begin_load(const PlannedLoad& load) {
    BlockState& block = blocks_[load.block];
    RAYPAGER_CHECK(block.state == PageState::absent);
    block.state = PageState::loading;
    active_.loading++;
    block.address = load.address;
    resident_bytes_ += block.bytes;
    RAYPAGER_CHECK(resident_bytes_ <= pool_.capacity());
    statistics_.peak_resident_bytes = std::max(statistics_.peak_resident_bytes, resident_bytes_);
    next_in_turn_ = static_cast<uint32_t>((load.block + 1) % blocks_.size());
}

Plan BlockTable::plan(uint32_t round, uint32_t ready_rays, uint32_t slots) {
    Plan plan = plan_paging(policy_, {blocks_, active_, round, ready_rays, slots, next_in_turn_}, std::move(pool_));
    pool_ = std::move(plan.pool);
    for (const uint32_t block : plan.evict) evict(round, block);
    for (const PlannedLoad& load : plan.load) begin_load(load);
    return plan;
}

}  // namespace raypager
