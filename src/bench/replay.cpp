#include "bench/replay.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "base/check.hpp"
#include "raypager/abi/path.h"
#include "residency/block_table.hpp"

namespace raypager::bench {
namespace {

// As few slabs as possible; a last one that might not take every block is left out (Residency does the same).
SlabAllocator make_pool(const DemandTrace& trace, const ReplaySettings& settings) {
    const uint64_t slab = settings.slab_bytes ? settings.slab_bytes : settings.pool_bytes;
    std::vector<uint64_t> sizes;
    for (uint64_t left = settings.pool_bytes; left >= std::max<uint64_t>(1, trace.largest_block()); left -= sizes.back())
        sizes.push_back(std::min(slab, left));
    return SlabAllocator(sizes);
}

class Replay {
public:
    Replay(const DemandTrace& trace, const ReplaySettings& settings)
        : trace_(trace),
          settings_(settings),
          table_(trace.block_bytes, make_pool(trace, settings), settings.policy),
          slots_(settings.slots),
          waiting_(trace.block_bytes.size()),
          demand_(trace.block_bytes.size()),
          changed_in_(trace.block_bytes.size()),
          entered_in_(trace.block_bytes.size()),
          seen_(trace.block_bytes.size()) {
        for (uint32_t slot = 0; slot < settings.slots; slot++) free_.push_back(slot);
    }

    ReplayResult run() {
        for (round_ = 1;; round_++) {
            publish();
            start_paths();
            const auto ready = static_cast<uint32_t>(ready_.size());
            if (ready == 0 && waiting_rays_ == 0) break;
            trace_ready_rays();
            under_way_.push_back({round_, ready, take_changes()});
            bool arrived = false;
            // With nothing to trace, no round is started before the host has seen to it.
            while (under_way_.size() >= (ready == 0 ? 1 : settings_.rounds_under_way)) arrived |= after_oldest_round();
            if (!arrived && (ready == 0 || settings_.wait_for_loads)) wait_for_arrival();
        }
        const PagingStatistics& paging = table_.statistics();
        result_.loads = paging.loads, result_.evictions = paging.evictions, result_.bytes_loaded = paging.bytes_loaded;
        result_.peak_resident_bytes = paging.peak_resident_bytes;
        result_.rounds = round_ - 1;
        result_.seconds = now_;
        return std::move(result_);
    }

private:
    // A path slot: the ray that it traces, and where that stands.
    struct Slot {
        uint64_t ray = 0, end = 0;
        uint32_t at = 0;  // the visit at which it waits
        uint32_t waits_since = 0;
    };
    struct Transfer {
        double end;
        uint32_t block;
    };
    // A round that the host has not seen yet.
    struct Round {
        uint32_t round, ready;
        std::vector<rp_block_demand> demand;
    };
    enum class Pass { ended, waits };

    // What kernels count of the block, about to be changed.
    rp_block_demand& demand(uint32_t block) {
        if (changed_in_[block] != round_) told_.push_back(block);
        changed_in_[block] = round_;
        return demand_[block];
    }
    // What the round that has been traced tells.
    std::vector<rp_block_demand> take_changes() {
        std::vector<rp_block_demand> changes;
        for (const uint32_t block : told_) {
            changes.push_back({block, static_cast<uint32_t>(waiting_[block].size()), demand_[block].bounces, demand_[block].used});
            demand_[block].bounces = 0;
        }
        told_.clear();
        return changes;
    }

    // The page table as rounds from now on see it; rays wake whose block has come.
    void publish() {
        for (const uint32_t block : changed_) {
            seen_[block] = table_.blocks()[block].state == PageState::resident;
            if (!seen_[block]) continue;
            for (const uint32_t slot : waiting_[block]) {
                next_ready_.push_back(slot);
                result_.longest_wait = std::max<uint64_t>(result_.longest_wait, round_ - slots_[slot].waits_since);
            }
            waiting_rays_ -= waiting_[block].size();
            waiting_[block].clear();
            (void)demand(block);
        }
        changed_.clear();
    }

    void start_paths() {
        while (!free_.empty() && next_path_ < trace_.path_count()) {
            const uint32_t slot = free_.back();
            free_.pop_back();
            begin_ray(slot, trace_.path_rays[next_path_], trace_.path_rays[next_path_ + 1]);
            next_path_++;
        }
        std::swap(ready_, next_ready_);
        next_ready_.clear();
    }

    void begin_ray(uint32_t slot, uint64_t ray, uint64_t end) {
        if (ray == end)
            free_.push_back(slot);
        else
            slots_[slot] = {ray, end, 0, 0}, next_ready_.push_back(slot);
    }

    void trace_ready_rays() {
        used_.clear();
        for (const uint32_t slot : ready_) {
            Slot& state = slots_[slot];
            result_.visits++;
            if ((trace_.rays[state.ray].shadow ? shadow_pass(state) : extension_pass(state)) == Pass::ended) {
                result_.rays++;
                begin_ray(slot, state.ray + 1, state.end);
            } else {
                state.waits_since = round_;
                const uint32_t block = trace_.visits_of(trace_.rays[state.ray])[state.at].block();
                waiting_[block].push_back(slot);
                (void)demand(block);
                waiting_rays_++;
            }
        }
        result_.service.blocks.insert(result_.service.blocks.end(), used_.begin(), used_.end());
        result_.service.begin.push_back(result_.service.blocks.size());
        const auto work = static_cast<double>(result_.visits - counted_visits_);
        counted_visits_ = result_.visits;
        now_ += settings_.round_seconds + work * settings_.visit_seconds / std::max(1e-30, trace_.share());
    }

    void enter(uint32_t block) {
        result_.visits++;
        if (counts_entries(settings_.policy.kind))
            demand(block).used++;
        else
            demand(block).used = round_;
        if (entered_in_[block] == round_) return;
        entered_in_[block] = round_;
        used_.push_back(block);
    }

    bool is_resident(uint32_t block) const { return seen_[block]; }

    // Strictly in the ray's order: it waits at the first absent block.
    Pass extension_pass(Slot& slot) {
        const TracedRay& ray = trace_.rays[slot.ray];
        const std::span<const Visit> visits = trace_.visits_of(ray);
        bool entered_hit = false;
        for (; slot.at < visits.size(); slot.at++) {
            const uint32_t block = visits[slot.at].block();
            if (!is_resident(block)) return Pass::waits;
            enter(block);
            entered_hit = entered_hit || block == ray.hit_block;
        }
        // Like the engine, which counts them only where the policy looks at them.
        if (entered_hit && settings_.policy.kind == PolicyKind::most_wanted) demand(ray.hit_block).bounces++;
        return Pass::ended;
    }

    // In its order, too, up to the first block that stops it.
    Pass shadow_pass(Slot& slot) {
        const std::span<const Visit> visits = trace_.visits_of(trace_.rays[slot.ray]);
        for (; slot.at < visits.size(); slot.at++) {
            const uint32_t block = visits[slot.at].block();
            if (!is_resident(block)) return Pass::waits;
            enter(block);
            if (visits[slot.at].stops()) return Pass::ended;
        }
        return Pass::ended;
    }

    // What the host does when it sees the oldest round that is under way. True if a block has come.
    bool after_oldest_round() {
        const Round round = std::move(under_way_.front());
        under_way_.pop_front();
        table_.take_demand(round.round, round.demand);
        const bool arrived = take_arrivals();
        const Plan plan = table_.plan(round.round, round.ready, settings_.slots);
        changed_.insert(changed_.end(), plan.evict.begin(), plan.evict.end());
        for (const PlannedLoad& load : plan.load) {
            const double bytes = trace_.block_bytes[load.block];
            bus_free_ = std::max(bus_free_, now_) + (settings_.bandwidth > 0 ? bytes / settings_.bandwidth : 0);
            transfers_.push_back({bus_free_, load.block});
        }
        return arrived;
    }

    void wait_for_arrival() {
        if (transfers_.empty()) return;
        const double begin = now_;
        now_ = std::max(now_, transfers_.front().end);
        result_.stall += now_ - begin;
        take_arrivals();
    }

    // What has come is seen from the next round on that starts.
    bool take_arrivals() {
        bool any = false;
        for (; !transfers_.empty() && transfers_.front().end <= now_; transfers_.pop_front(), any = true) {
            table_.arrive(round_, transfers_.front().block);
            changed_.push_back(transfers_.front().block);
        }
        return any;
    }

    const DemandTrace& trace_;
    const ReplaySettings& settings_;
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
    std::deque<Round> under_way_;
    std::deque<Transfer> transfers_;  // in the order in which they end
    uint64_t next_path_ = 0, waiting_rays_ = 0, counted_visits_ = 0;
    uint32_t round_ = 0;
    double now_ = 0, bus_free_ = 0;
    ReplayResult result_;
};

}  // namespace

ReplayResult replay(const DemandTrace& trace, const ReplaySettings& settings) {
    RAYPAGER_CHECK(settings.slots > 0 && settings.pool_bytes >= trace.largest_block());
    return Replay(trace, settings).run();
}

uint32_t slots_of_share(const DemandTrace& trace, uint64_t slots) {
    return static_cast<uint32_t>(std::max(1.0, std::round(static_cast<double>(slots) * trace.share())));
}

ReplaySettings recorded_settings(const DemandTrace& trace) {
    const RecordedRender& recorded = trace.recorded;
    ReplaySettings settings;
    settings.policy = recorded.policy;
    settings.pool_bytes = recorded.pool_bytes;
    settings.slab_bytes = recorded.slab_bytes;
    settings.slots = slots_of_share(trace, recorded.slots);
    settings.wait_for_loads = recorded.wait_for_loads;
    settings.rounds_under_way = recorded.rounds_under_way;
    const double work = static_cast<double>(trace.visits.size() + trace.rays.size()) / std::max(1e-30, trace.share());
    settings.visit_seconds = work > 0 ? recorded.trace_seconds / work : 0;
    return settings;
}

}  // namespace raypager::bench
