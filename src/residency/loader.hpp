// Brings blocks onto the device while kernels run: threads get blocks from the host cache, which reads them from their source where it must,
// and start their uploads on the device's second queue. The render loop asks between rounds what has arrived.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "device/device.hpp"
#include "residency/host_cache.hpp"
#include "residency/policy.hpp"

namespace raypager {

// A block or page of images that has come, and, of a block in its stored form, where kernels find its sections (abi/block.h, rp_page).
struct Arrival {
    uint32_t block, leaves_at, vertices_at;
};

class Loader {
public:
    // cache and slabs outlive the loader. threads 0: as many as the device's profile says.
    static std::unique_ptr<Loader> create(Device& device, HostCache& cache, const std::vector<Buffer>& slabs, uint32_t threads = 0);
    ~Loader();
    // The places are written after `free`, when no kernel reads them any more; those that were free before after `free_before`.
    void start(std::span<const PlannedLoad> loads, const Event& free, const Event& free_before);
    // Blocks whose upload has finished since the last call. With wait set, and loads under way, returns at least one.
    Result<std::vector<Arrival>> arrived(bool wait);
    uint32_t under_way() const;
    // Blocks of loads that no thread has begun with, the next first.
    std::vector<uint32_t> to_begin() const;
    // What it is doing at this moment, for people. From any thread.
    std::string activity() const;

private:
    struct Load {
        uint32_t block;
        PoolAddress address;
        Event free;
        std::span<const std::byte> bytes;  // held in the cache from when a thread works on it
        Arrival arrival;
        std::optional<Event> upload;  // of the last of those that are submitted together: the queue is in order
    };
    Loader(Device& device, HostCache& cache, const std::vector<Buffer>& slabs) : device_(device), cache_(cache), slabs_(slabs) { cache_.enter(); }
    void work();
    // Brings the first that waits, and those that follow as far as they are in the cache. Holds the lock before and after, not meanwhile.
    void carry_out_first(std::unique_lock<std::mutex>& lock);
    Status bring(std::vector<Load>& loads);
    void release_unsubmitted(const std::vector<Load>& loads);
    Status submit(std::vector<Load>& loads);

    Device& device_;
    HostCache& cache_;
    const std::vector<Buffer>& slabs_;
    std::mutex submitting_;  // keeps submitted_ in the order of the queue; taken before mutex_
    Event last_free_;        // that the queue waits for already; under submitting_
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Load> waiting_;    // for a thread
    std::deque<Load> submitted_;  // uploads under way, in the order of the queue
    // Blocks that threads are working on, until their uploads are submitted, and since when.
    std::map<uint32_t, std::chrono::steady_clock::time_point> reading_;
    bool unflushed_ = false;  // uploads that arrived() has to flush
    Status failure_;
    bool stop_ = false;
    std::atomic<bool> given_up_{false};
    std::vector<std::thread> threads_;  // none: the render loop's own thread does their work when it asks what has arrived
};

}  // namespace raypager
