// Reads blocks into the host cache before they are loaded, with threads of its own: those that rays wait for while loads are held back, or that
// have to wait for their turn. So loads are copies from memory by the time that rays depend on them. Never takes room from what is cached.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "residency/host_cache.hpp"
#include "residency/policy.hpp"

namespace raypager {

class ReadAhead {
public:
    // The cache outlives it. Without threads nothing is read ahead. room: so many bytes of the cache's memory are had at once; a driver takes a
    // quarter of a millisecond to pin a megabyte, and the first blocks would wait for that.
    ReadAhead(HostCache& cache, size_t threads, uint64_t room);
    ~ReadAhead();
    ReadAhead(const ReadAhead&) = delete;
    ReadAhead& operator=(const ReadAhead&) = delete;
    // What is to be read: first the blocks of the loads, then those behind them. In place of what was said before.
    void want(std::span<const PlannedLoad> loads, std::span<const uint32_t> behind);

private:
    void work();

    HostCache& cache_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<uint32_t> wanted_;
    bool stop_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace raypager
