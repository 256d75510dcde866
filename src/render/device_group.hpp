// All devices of a job. One is driven by whoever calls step(); several have a thread each, and step() waits for what they get done.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "render/device_worker.hpp"

namespace raypager {

class DeviceGroup {
public:
    DeviceGroup() = default;
    ~DeviceGroup();
    DeviceGroup(const DeviceGroup&) = delete;
    DeviceGroup& operator=(const DeviceGroup&) = delete;

    // shared: more samples may come whenever all have begun. What is handed in outlives the group. One worker at least; the first one's cache of
    // blocks is that of all.
    void begin(std::vector<std::unique_ptr<DeviceWorker>> workers, SamplePool& pool, bool shared);
    bool several() const { return threaded_; }  // or were, at the beginning

    // One device: a round. Several: whatever they do in some milliseconds. An error of one of several is kept: failed().
    Status step();
    // No round is under way anywhere, until the next step; or some device has failed, and then others may not have come to that. Only then may
    // anything but figures() be asked of the workers' wavefronts; and of all else of theirs only where they are still, and do not take in blocks that
    // have come either.
    Status settle(bool still = false);
    // Whether there is nothing left to do, on any device.
    bool idle() const;

    // A device that has failed: then its work must be given to others, and it must be dropped, before the next step. None: null.
    struct Failure {
        DeviceWorker* worker = nullptr;
        Status error;
        WorkerFigures figures;  // after its last round
    };
    Failure failed() const;
    // As if it had failed by itself. REQUIRES: settled.
    void fail(const DeviceWorker& worker, const Status& error);
    // Without its device; that of the first worker stays, as it holds the cache's memory.
    void drop(DeviceWorker& worker);

    size_t count() const { return workers_.size(); }  // of those that have not been dropped
    DeviceWorker& worker(size_t i) const { return *workers_[i]; }
    std::vector<WorkerFigures> figures() const;  // of each, after its last round
    void note_figures();                         // once workers have begun anew. REQUIRES: settled
    void doing(const char* what);                // for the watchdogs of all
    void expect_progress(bool expected);

private:
    struct Member {
        std::unique_ptr<DeviceWorker> worker;
        WorkerFigures figures;
        Status error;
        bool parked = false, takes_arrivals = false, idle = false, ended = false;
        std::thread thread;
    };
    void run(Member& member);
    Status work(Member& member, std::unique_lock<std::mutex>& lock);
    void stop();

    std::vector<std::unique_ptr<Member>> members_;
    std::vector<DeviceWorker*> workers_;
    std::unique_ptr<Device> cache_device_;  // of a first worker that was dropped
    SamplePool* pool_ = nullptr;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool shared_ = false, threaded_ = false, parking_ = true, still_ = false, stop_ = false;
};

}  // namespace raypager
