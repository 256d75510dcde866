#include "residency/read_ahead.hpp"

#include <new>

namespace raypager {

ReadAhead::ReadAhead(HostCache& cache, size_t threads, uint64_t room) : cache_(cache) {
    for (size_t i = 0; i < threads; i++)
        threads_.emplace_back([this, first = i == 0 ? room : 0] {
            cache_.prepare(first);
            work();
        });
}

ReadAhead::~ReadAhead() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    cache_.close();
    for (std::thread& thread : threads_) thread.join();
}

void ReadAhead::want(std::span<const PlannedLoad> loads, std::span<const uint32_t> behind) {
    if (threads_.empty() || (loads.empty() && behind.empty())) return;
    {
        const std::lock_guard lock(mutex_);
        wanted_.clear();
        for (const PlannedLoad& load : loads) wanted_.push_back(load.block);
        wanted_.insert(wanted_.end(), behind.begin(), behind.end());
    }
    changed_.notify_one();
}

// A block that cannot be read is left to its load, which says why.
void ReadAhead::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [&] { return stop_ || !wanted_.empty(); });
        if (stop_) return;
        const uint32_t block = wanted_.front();
        wanted_.pop_front();
        const bool more = !wanted_.empty();
        lock.unlock();
        bool room = true;
        if (!cache_.knows(block)) {
            // Mostly all are there, and one thread is enough to find that out.
            if (more) changed_.notify_one();
            try {
                room = cache_.read_ahead(block);
            } catch (const std::bad_alloc&) {
                room = false;
            }
        }
        lock.lock();
        if (!room) wanted_.clear();
    }
}

}  // namespace raypager
