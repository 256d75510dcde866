#include "bench/device_replay.hpp"

#include <algorithm>

#include "base/check.hpp"

namespace raypager::bench {
namespace {

// As few slabs as possible; a last one that might not take every block is left out (Residency does the same).
SlabAllocator make_pool(const DemandTrace& trace, const DeviceReplaySettings& settings) {
    const uint64_t slab = settings.slab_bytes ? settings.slab_bytes : settings.pool_bytes;
    std::vector<uint64_t> sizes;
    for (uint64_t left = settings.pool_bytes; left >= std::max<uint64_t>(1, trace.largest_block()); left -= sizes.back())
        sizes.push_back(std::min(slab, left));
    return SlabAllocator(sizes);
}

}  // namespace

DeviceReplay::DeviceReplay(const DemandTrace& trace, const DeviceReplaySettings& settings, NextPath next_path)
    : trace_(trace),
      policy_(settings.policy.kind),
      slot_count_(settings.slots),
      keeps_order_(settings.keeps_order),
      next_path_(std::move(next_path)),
      table_(trace.block_bytes, make_pool(trace, settings), settings.policy),
      slots_(settings.slots),
      waiting_(trace.block_bytes.size()),
      demand_(trace.block_bytes.size()),
      changed_in_(trace.block_bytes.size()),
      entered_in_(trace.block_bytes.size()),
      seen_(trace.block_bytes.size()) {
    RAYPAGER_CHECK(settings.slots > 0 && settings.pool_bytes >= trace.largest_block());
    for (uint32_t slot = 0; slot < settings.slots; slot++) free_.push_back(slot);
}

std::optional<DeviceReplay::Round> DeviceReplay::start_round() {
    round_++;
    publish();
    start_paths();
    const auto ready = static_cast<uint32_t>(ready_.size());
    if (ready == 0 && waiting_rays_ == 0) return std::nullopt;
    const uint64_t before = visits_;
    trace_ready_rays();
    under_way_.push_back({round_, ready, take_changes()});
    rounds_ = round_;
    return Round{ready, visits_ - before};
}

void DeviceReplay::see_oldest() {
    RAYPAGER_CHECK(!under_way_.empty());
    oldest_ = std::move(under_way_.front());
    under_way_.pop_front();
    table_.take_demand(oldest_.round, oldest_.demand);
}

void DeviceReplay::arrive(uint32_t block) {
    table_.arrive(round_, block);
    changed_.push_back(block);
}

std::vector<PlannedLoad> DeviceReplay::plan() {
    Plan plan = table_.plan(oldest_.round, oldest_.ready, slot_count_);
    changed_.insert(changed_.end(), plan.evict.begin(), plan.evict.end());
    return std::move(plan.load);
}

// What kernels count of the block, about to be changed.
rp_block_demand& DeviceReplay::demand(uint32_t block) {
    if (changed_in_[block] != round_) told_.push_back(block);
    changed_in_[block] = round_;
    return demand_[block];
}

// What the round that has been traced tells.
std::vector<rp_block_demand> DeviceReplay::take_changes() {
    std::vector<rp_block_demand> changes;
    for (const uint32_t block : told_) {
        changes.push_back({block, static_cast<uint32_t>(waiting_[block].size()), demand_[block].bounces, demand_[block].used});
        demand_[block].bounces = 0;
    }
    told_.clear();
    return changes;
}

// The page table as rounds from now on see it; rays wake whose block has come.
void DeviceReplay::publish() {
    for (const uint32_t block : changed_) {
        seen_[block] = table_.blocks()[block].state == PageState::resident;
        if (!seen_[block]) continue;
        for (const uint32_t slot : waiting_[block]) {
            next_ready_.push_back(slot);
            longest_wait_ = std::max<uint64_t>(longest_wait_, round_ - slots_[slot].waits_since);
        }
        waiting_rays_ -= waiting_[block].size();
        waiting_[block].clear();
        (void)demand(block);
    }
    changed_.clear();
}

void DeviceReplay::start_paths() {
    while (!free_.empty() && paths_left_) {
        const std::optional<uint64_t> path = next_path_();
        paths_left_ = path.has_value();
        if (!path) break;
        const uint32_t slot = free_.back();
        free_.pop_back();
        begin_ray(slot, trace_.path_rays[*path], trace_.path_rays[*path + 1]);
    }
    std::swap(ready_, next_ready_);
    next_ready_.clear();
}

void DeviceReplay::begin_ray(uint32_t slot, uint64_t ray, uint64_t end) {
    if (ray == end)
        free_.push_back(slot);
    else
        slots_[slot] = {ray, end, 0, 0}, next_ready_.push_back(slot);
}

void DeviceReplay::trace_ready_rays() {
    used_.clear();
    for (const uint32_t slot : ready_) {
        Slot& state = slots_[slot];
        visits_++;
        if ((trace_.rays[state.ray].shadow ? shadow_pass(state) : extension_pass(state)) == Pass::ended) {
            rays_++;
            begin_ray(slot, state.ray + 1, state.end);
        } else {
            state.waits_since = round_;
            const uint32_t block = trace_.visits_of(trace_.rays[state.ray])[state.at].block();
            waiting_[block].push_back(slot);
            (void)demand(block);
            waiting_rays_++;
        }
    }
    if (!keeps_order_) return;
    service_.blocks.insert(service_.blocks.end(), used_.begin(), used_.end());
    service_.begin.push_back(service_.blocks.size());
}

void DeviceReplay::enter(uint32_t block) {
    visits_++;
    if (counts_entries(policy_))
        demand(block).used++;
    else
        demand(block).used = round_;
    if (entered_in_[block] == round_) return;
    entered_in_[block] = round_;
    used_.push_back(block);
}

// Strictly in the ray's order: it waits at the first absent block.
DeviceReplay::Pass DeviceReplay::extension_pass(Slot& slot) {
    const TracedRay& ray = trace_.rays[slot.ray];
    const std::span<const Visit> visits = trace_.visits_of(ray);
    bool entered_hit = false;
    for (; slot.at < visits.size(); slot.at++) {
        const uint32_t block = visits[slot.at].block();
        if (!seen_[block]) return Pass::waits;
        enter(block);
        entered_hit = entered_hit || block == ray.hit_block;
    }
    // Like the engine, which counts them only where the policy looks at them.
    if (entered_hit && policy_ == PolicyKind::most_wanted) demand(ray.hit_block).bounces++;
    return Pass::ended;
}

// In its order, too, up to the first block that stops it.
DeviceReplay::Pass DeviceReplay::shadow_pass(Slot& slot) {
    const std::span<const Visit> visits = trace_.visits_of(trace_.rays[slot.ray]);
    for (; slot.at < visits.size(); slot.at++) {
        const uint32_t block = visits[slot.at].block();
        if (!seen_[block]) return Pass::waits;
        enter(block);
        if (visits[slot.at].stops()) return Pass::ended;
    }
    return Pass::ended;
}

}  // namespace raypager::bench
