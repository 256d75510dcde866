#include "residency/read_ahead.hpp"

#include <new>
#include <system_error>
#include <utility>

namespace raypager {

ReadAhead::ReadAhead(HostCache& cache, size_t threads, uint64_t room) : cache_(cache) {
    try {
        for (size_t i = 0; i < threads; i++) threads_.emplace_back([this, first = i == 0 ? room : 0] { work(first); });
    } catch (const std::system_error&) {  // no more threads: then with those that there are
    }
}

ReadAhead::~ReadAhead() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void ReadAhead::request(std::vector<uint32_t> blocks) {
    if (threads_.empty()) return;
    bool any;
    {
        const std::lock_guard lock(mutex_);
        wanted_ = std::move(blocks);
        taken_ = 0;
        lists_++;
        any = !wanted_.empty();
    }
    if (any) changed_.notify_one();
}

void ReadAhead::work(uint64_t room) {
    const auto stopped = [this] {
        const std::lock_guard lock(mutex_);
        return stop_;
    };
    try {
        while (room > 0 && !stopped() && cache_.prepare(room)) {}
    } catch (const std::bad_alloc&) {  // whoever needs the memory will say so
    }
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [&] { return stop_ || taken_ < wanted_.size(); });
        if (stop_) return;
        const uint32_t block = wanted_[taken_++], list = lists_;
        const bool more = taken_ < wanted_.size();
        lock.unlock();
        bool has_room = true;
        if (!cache_.knows(block)) {
            // Mostly all are there, and one thread is enough to find that out.
            if (more) changed_.notify_one();
            try {
                has_room = cache_.read_ahead(block);
            } catch (const std::bad_alloc&) {
                has_room = false;
            }
        }
        lock.lock();
        if (!has_room && list == lists_) taken_ = wanted_.size();
    }
}

}  // namespace raypager
