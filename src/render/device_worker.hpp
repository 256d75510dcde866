// One device at work on a job: its rounds, with samples that it takes from the job's pool. Whoever calls it does so from one thread at a time.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>

#include "render/checkpoint.hpp"
#include "render/device_rounds.hpp"
#include "render/sample_pool.hpp"
#include "render/watchdog.hpp"

namespace raypager {

// What is known of a device's work after a round.
struct WorkerFigures {
    RoundCounters counters;
    PagingStatistics paging;
    WorkDone work;            // of this device, without seconds of rendering
    uint64_t begun = 0;       // samples by number
    uint64_t again_left = 0;  // samples that are to be begun again, and have not been
    uint32_t index = 0;       // of the device
    uint32_t slots = 0, ready_rays = 0, rounds = 0;
    uint64_t resident_bytes = 0, pool_bytes = 0, texture_waits = 0;
    bool begins_again = false, all_idle = false;
};

struct WorkerCallbacks {
    std::function<void(const std::string&)> warn;  // a line for the user
    std::function<Status()> round_ended;           // after each round; may be empty
};

class DeviceWorker {
public:
    // What is handed in outlives the worker. several: others take from the same pool, so there may be more samples whenever it has begun all it had.
    DeviceWorker(std::unique_ptr<DeviceRounds> rounds, SamplePool& pool, const RenderOptions& options, WorkerCallbacks callbacks, bool several);
    ~DeviceWorker();

    // One round, and the paging behind it. REQUIRES: there is something to do.
    Status round();
    // Ends all rounds under way, so that the counters are those of the state on the device.
    Status settle();
    // Takes what there is for it in the pool, as far as it will need more soon. Whether there is something to do then.
    Result<bool> take_samples();
    // Between rounds: what has come is not held back from other devices.
    Status take_arrivals();

    // Whether there have been rounds since its film was taken.
    bool has_new_film() const { return rounds_->started() != film_round_; }
    // After the film, and the samples whose paths are under way, have been taken from it.
    void film_was_taken(std::vector<rp_path_sample> under_way);
    // What it has begun or was to begin, and what others must do in its place if it fails: its film is lost then.
    std::vector<SampleRange> ranges_since_film() const;
    const std::vector<rp_path_sample>& again_since_film() const { return again_; }
    uint64_t begun_before_film() const { return begun_before_film_; }

    // False: after an error nothing is left but its destructor, release_device, and what is told of the device in share().
    bool usable() const { return rounds_ && rounds_->usable(); }
    WorkerFigures figures() const;
    Watchdog& watchdog() { return *watchdog_; }
    DeviceRounds& rounds() { return *rounds_; }
    const DeviceRounds& rounds() const { return *rounds_; }
    Wavefront& wavefront() { return rounds_->wavefront(); }
    const Wavefront& wavefront() const { return rounds_->wavefront(); }
    // Without rounds under way: begins anew with another picture (DeviceRounds::restart).
    Status restart(const rp_render_params& params);
    // Without rounds under way: ends them, and hands over the device.
    std::unique_ptr<Device> release_device();
    // Goes on with others then.
    void take_rounds(std::unique_ptr<DeviceRounds> rounds);

private:
    Status finish_round();
    void watch();
    void begin_anew();

    std::unique_ptr<DeviceRounds> rounds_;
    SamplePool& pool_;
    const RenderOptions& options_;
    const WorkerCallbacks callbacks_;
    const bool several_;
    std::unique_ptr<Watchdog> watchdog_;  // asks rounds_: destroyed before it
    uint64_t begun_last_ = 0;             // samples that the round before began
    uint64_t begun_before_film_ = 0;
    uint32_t film_round_ = 0;            // rounds that were started before the film was taken
    std::vector<rp_path_sample> again_;  // that it was given since the film was taken, or that were under way then
};

}  // namespace raypager
