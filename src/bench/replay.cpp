#include "bench/replay.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "base/check.hpp"

namespace raypager::bench {
namespace {

class Replay {
public:
    Replay(const DemandTrace& trace, const ReplaySettings& settings)
        : trace_(trace),
          settings_(settings),
          device_(trace, {settings.policy, settings.pool_bytes, settings.slab_bytes, settings.slots, true}, [this] { return next_path(); }) {}

    ReplayResult run() {
        while (const auto round = device_.start_round()) {
            now_ += settings_.round_seconds + static_cast<double>(round->visits) * settings_.visit_seconds / std::max(1e-30, trace_.share());
            bool arrived = false;
            // With nothing to trace, no round is started before the host has seen to it.
            while (device_.under_way() >= (round->ready == 0 ? 1 : settings_.rounds_under_way)) arrived |= after_oldest_round();
            if (!arrived && (round->ready == 0 || settings_.wait_for_loads)) wait_for_arrival();
        }
        const PagingStatistics& paging = device_.paging();
        result_.loads = paging.loads, result_.evictions = paging.evictions, result_.bytes_loaded = paging.bytes_loaded;
        result_.peak_resident_bytes = paging.peak_resident_bytes;
        result_.rounds = device_.rounds(), result_.rays = device_.rays(), result_.visits = device_.visits();
        result_.longest_wait = device_.longest_wait();
        result_.service = device_.take_service();
        result_.seconds = now_;
        return std::move(result_);
    }

private:
    struct Transfer {
        double end;
        uint32_t block;
    };

    std::optional<uint64_t> next_path() {
        if (next_path_ == trace_.path_count()) return std::nullopt;
        return next_path_++;
    }

    // What the host does when it sees the oldest round that is under way. True if a block has come.
    bool after_oldest_round() {
        device_.see_oldest();
        const bool arrived = take_arrivals();
        for (const PlannedLoad& load : device_.plan()) {
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
        for (; !transfers_.empty() && transfers_.front().end <= now_; transfers_.pop_front(), any = true) device_.arrive(transfers_.front().block);
        return any;
    }

    const DemandTrace& trace_;
    const ReplaySettings& settings_;
    uint64_t next_path_ = 0;
    DeviceReplay device_;
    std::deque<Transfer> transfers_;  // in the order in which they end
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
