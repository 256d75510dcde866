// Reads blocks into the host cache before they are loaded, with threads of its own: those that rays wait for while loads are held back, or that
// have to wait for their turn. So loads are copies from memory by the time that rays depend on them. Never takes room from what is cached.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "residency/host_cache.hpp"

namespace raypager {

class ReadAhead {
public:
    // The cache outlives it. Without threads nothing is read ahead. room: so many bytes of the cache's memory are had at once, so that the
    // first blocks need not wait while a driver pins it.
    ReadAhead(HostCache& cache, size_t threads, uint64_t room);
    ~ReadAhead();
    ReadAhead(const ReadAhead&) = delete;
    ReadAhead& operator=(const ReadAhead&) = delete;
    // What is to be read, in this order, in place of what was said before.
    void request(std::vector<uint32_t> blocks);

private:
    void work(uint64_t room);

    HostCache& cache_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<uint32_t> wanted_;
    size_t taken_ = 0;    // of these
    uint32_t lists_ = 0;  // that there have been
    bool stop_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace raypager
