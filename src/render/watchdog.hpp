// Says when a render makes no progress, and what it hangs on. It only tells: nothing is hidden, nothing is broken off.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "residency/residency.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {

// A render after one of its rounds.
struct RoundState {
    struct Request {
        uint32_t block = 0, rays = 0, since_round = 0;
        bool loading = false;
    };
    uint32_t round = 0, ready_rays = 0, waiting_rays = 0, requested_blocks = 0;
    uint64_t resident_bytes = 0, pool_bytes = 0;
    std::vector<Request> most_wanted;  // a few, most rays first
    // Grows with whatever was achieved: rays begun, paths finished, blocks loaded, ... Equal numbers: the round achieved nothing.
    uint64_t achieved = 0;
};

RoundState make_round_state(uint32_t round, const RoundCounters& counters, const Residency& residency);
// One line: what rays wait for, the pool.
std::string describe(const RoundState& state);

class Watchdog {
public:
    // After `seconds` without progress, and again after twice as long each time, report is called with a line of text, from a thread of
    // its own. loader: what the loader does at this moment; called from that thread, too. 0 seconds: never.
    Watchdog(double seconds, std::function<std::string()> loader, std::function<void(const std::string&)> report);
    ~Watchdog();
    Watchdog(const Watchdog&) = delete;
    Watchdog& operator=(const Watchdog&) = delete;

    void round_ended(RoundState state);
    // There is nothing for this device to do.
    void waits_for_others();
    // What the render is about to do, for reports: "waiting for a block". A literal.
    void doing(const char* what);
    // Between these two nobody expects progress.
    void pause();
    void resume();

private:
    using Clock = std::chrono::steady_clock;
    void watch();
    std::string report_text(double seconds) const;

    const double seconds_;
    const std::function<std::string()> loader_;
    const std::function<void(const std::string&)> report_;
    std::mutex mutex_;
    std::condition_variable changed_;
    RoundState state_;
    const char* doing_ = "starting";
    Clock::time_point last_progress_ = Clock::now();
    double next_report_;  // seconds without progress
    std::optional<Clock::time_point> paused_;
    bool stop_ = false;
    std::thread thread_;  // last: uses all others
};

}  // namespace raypager
