// Items that all cores make and one thread takes, in order.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/parallel.hpp"

namespace raypager {

// One call of make_in_order, which see.
template <class Make, class Take>
class InOrder {
public:
    InOrder(size_t count, size_t ahead, const Make& make, const Take& take)
        : count_(count), make_(make), take_(take), workers_(helping_workers()), items_(std::min(ahead, count)) {}

    Status run() {
        if (workers_ <= 1 || count_ <= 1) return by_this_thread();
        std::thread makers;
        try {
            makers = std::thread([this] { make_all(); });
        } catch (const std::system_error&) {  // no more threads
            return by_this_thread();
        }
        Status status;
        try {
            status = take_all();
        } catch (...) {
            end(std::current_exception());
        }
        end();
        makers.join();
        if (failure_) std::rethrow_exception(failure_);
        return status;
    }

private:
    using Item = std::invoke_result_t<const Make&, size_t>;

    Status by_this_thread() const {
        for (size_t i = 0; i < count_; i++) RAYPAGER_TRY(take_(i, make_(i)));
        return {};
    }

    void make_all() {
        const WorkersAtMost as_the_caller(workers_);
        try {
            parallel_for(count_, 1, [this](size_t i, size_t) { make_one(i); });
        } catch (...) {
            end(std::current_exception());
        }
    }

    // The others may wait for this one to be taken, so they must hear of a failure at once.
    void make_one(size_t i) {
        try {
            std::unique_lock lock(mutex_);
            taken_.wait(lock, [&] { return i < next_ + items_.size() || ends_; });
            if (ends_) return;
            lock.unlock();
            Item item = make_(i);
            lock.lock();
            items_[i % items_.size()] = std::move(item);
            if (i == next_) made_.notify_one();
        } catch (...) {
            end(std::current_exception());
        }
    }

    Status take_all() {
        for (size_t i = 0; i < count_; i++) {
            std::unique_lock lock(mutex_);
            std::optional<Item>& place = items_[i % items_.size()];
            made_.wait(lock, [&] { return place || ends_; });
            if (ends_) return {};
            Item item = *std::exchange(place, std::nullopt);
            lock.unlock();
            RAYPAGER_TRY(take_(i, std::move(item)));
            lock.lock();
            next_++;
            taken_.notify_all();
        }
        return {};
    }

    void end(std::exception_ptr failure = nullptr) {
        const std::lock_guard lock(mutex_);
        ends_ = true;
        if (failure) failure_ = std::move(failure);
        made_.notify_one();
        taken_.notify_all();
    }

    const size_t count_;
    const Make& make_;
    const Take& take_;
    const size_t workers_;

    std::mutex mutex_;  // of all that follows
    std::condition_variable made_, taken_;
    std::vector<std::optional<Item>> items_;  // a ring
    size_t next_ = 0;                         // to be taken, or being taken
    bool ends_ = false;
    std::exception_ptr failure_;
};

// Calls make(i) for each i below count, on all cores, and take(i, item) with what it returned: in order, one at a time, by this thread, while others
// go on making. ahead: so many items at most, at least 1, are being made, wait, or are being taken. After a failure of take the rest is left; an
// exception is thrown again here.
template <class Make, class Take>
Status make_in_order(size_t count, size_t ahead, const Make& make, const Take& take) {
    return InOrder<Make, Take>(count, ahead, make, take).run();
}

}  // namespace raypager
