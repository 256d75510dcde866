#include "render/watchdog.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/words.hpp"

namespace raypager {

RoundState make_round_state(uint32_t round, const RoundCounters& counters, const Residency& residency) {
    RoundState state;
    state.round = round;
    state.ready_rays = counters.extend_rays() + counters.shadow_rays() + counters.textured_slots();
    state.waiting_rays = counters.waiting_rays();
    state.resident_bytes = residency.resident_bytes();
    state.pool_bytes = residency.pool_bytes();
    const PagingStatistics& paging = residency.statistics();
    state.achieved = counters.samples_begun() + counters.camera_rays() + counters.bounce_rays() + counters.total_shadow_rays() +
                     counters.textured_slots() + counters.idle_slots() + counters.requests_served() + paging.loads + paging.evictions;
    constexpr size_t told = 3;
    const std::span<const BlockState> blocks = residency.blocks();
    residency.active().wanted.for_each([&](uint32_t i) {
        state.requested_blocks++;
        auto& most = state.most_wanted;
        if (most.size() == told && blocks[i].requests <= most.back().rays) return;
        const auto at = std::find_if(most.begin(), most.end(), [&](const RoundState::Request& request) { return request.rays < blocks[i].requests; });
        most.insert(at, {i, blocks[i].requests, blocks[i].requested_since, blocks[i].state == PageState::loading});
        if (most.size() > told) most.pop_back();
    });
    return state;
}

std::string describe(const RoundState& state) {
    std::string requests;
    for (const RoundState::Request& request : state.most_wanted)
        requests += fmt::format("{}block {} by {} since round {}{}", requests.empty() ? "; most wanted: " : ", ", request.block,
                                counted(request.rays, "ray"), request.since_round, request.loading ? ", loading" : "");
    return fmt::format("ready: {}; waiting: {} for {}{}; pool: {} of {} in use", counted(state.ready_rays, "ray"), counted(state.waiting_rays, "ray"),
                       counted(state.requested_blocks, "block"), requests, format_bytes(state.resident_bytes), format_bytes(state.pool_bytes));
}

Watchdog::Watchdog(double seconds, std::function<std::string()> loader, std::function<void(const std::string&)> report)
    : seconds_(seconds), loader_(std::move(loader)), report_(std::move(report)), next_report_(seconds) {
    if (seconds_ > 0) thread_ = std::thread([this] { watch(); });
}

Watchdog::~Watchdog() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void Watchdog::round_ended(RoundState state) {
    const std::lock_guard lock(mutex_);
    if (state.achieved != state_.achieved) {
        last_progress_ = Clock::now();
        next_report_ = seconds_;
    }
    state_ = std::move(state);
}

void Watchdog::waits_for_others() {
    const std::lock_guard lock(mutex_);
    last_progress_ = Clock::now();
    next_report_ = seconds_;
}

void Watchdog::doing(const char* what) {
    const std::lock_guard lock(mutex_);
    doing_ = what;
}

void Watchdog::pause() {
    const std::lock_guard lock(mutex_);
    if (!paused_) paused_ = Clock::now();
}

void Watchdog::resume() {
    const std::lock_guard lock(mutex_);
    if (!paused_) return;
    last_progress_ += Clock::now() - *paused_;
    paused_.reset();
    changed_.notify_all();
}

std::string Watchdog::report_text(double seconds) const {
    return fmt::format("no progress for {:.1f} s; {} after round {}: {}; loader: {}; still going on", seconds, doing_, state_.round, describe(state_),
                       loader_());
}

void Watchdog::watch() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
        if (paused_) {
            changed_.wait(lock);
            continue;
        }
        const double passed = std::chrono::duration<double>(Clock::now() - last_progress_).count();
        if (passed >= next_report_) {
            next_report_ = 2 * passed;
            const std::string text = report_text(passed);
            lock.unlock();
            report_(text);
            lock.lock();
            continue;
        }
        changed_.wait_for(lock, std::chrono::duration<double>(next_report_ - passed));
    }
}

}  // namespace raypager
