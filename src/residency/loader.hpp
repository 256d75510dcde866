// Brings blocks onto the device while kernels run: a thread reads a block (host cache or file) into a pinned buffer and starts its
// upload on the device's second queue. The render loop asks between rounds what has arrived.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "device/device.hpp"
#include "residency/host_cache.hpp"
#include "residency/slab_allocator.hpp"

namespace raypager {

class Loader {
public:
    // slabs outlive the loader. At most `staging_count` loads are under way at once.
    static Result<std::unique_ptr<Loader>> create(Device& device, const BakedScene& scene, HostCache& cache, const std::vector<Buffer>& slabs,
                                                  uint32_t staging_count);
    ~Loader();
    // REQUIRES: fewer than staging_count loads under way; no kernel may read that place from now on.
    void start(uint32_t block, PoolAddress address);
    // Blocks whose upload has finished since the last call. With wait set, and loads under way, returns at least one.
    Result<std::vector<uint32_t>> arrived(bool wait);
    uint32_t under_way() const;

private:
    struct Load {
        uint32_t block;
        PoolAddress address;
        size_t staging;
        Event upload;
    };
    Loader(Device& device, const BakedScene& scene, HostCache& cache, const std::vector<Buffer>& slabs)
        : device_(device), scene_(scene), cache_(cache), slabs_(slabs) {}
    void work();
    Status bring(Load& load);

    Device& device_;
    const BakedScene& scene_;
    HostCache& cache_;
    const std::vector<Buffer>& slabs_;
    std::vector<PinnedBuffer> staging_;
    std::vector<size_t> free_staging_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Load> waiting_;    // for the thread
    std::deque<Load> submitted_;  // uploads under way, in order
    uint32_t reading_ = 0;        // 1 while the thread works on a load
    Status failure_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace raypager
