#include "base/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/check.hpp"

namespace raypager {
namespace {

thread_local size_t workers_at_most = SIZE_MAX;  // for calls by this thread

}  // namespace

WorkersAtMost::WorkersAtMost(size_t threads) : before_(std::exchange(workers_at_most, threads)) { RAYPAGER_CHECK(threads >= 1); }
WorkersAtMost::~WorkersAtMost() { workers_at_most = before_; }

size_t helping_workers() { return std::min(worker_count(), workers_at_most); }

size_t worker_count() { return std::max<size_t>(1, std::thread::hardware_concurrency()); }

void parallel_for(size_t count, size_t piece, const std::function<void(size_t, size_t)>& work, size_t most) {
    piece = std::max<size_t>(1, piece);
    const size_t pieces = (count + piece - 1) / piece, threads = std::min({helping_workers(), pieces, most});
    if (threads <= 1) {
        for (size_t begin = 0; begin < count; begin += piece) work(begin, std::min(count, begin + piece));
        return;
    }
    std::atomic<size_t> next{0};
    std::mutex mutex;
    std::exception_ptr failure;
    auto run = [&] {
        const WorkersAtMost inside(1);
        try {
            for (size_t begin; (begin = next.fetch_add(piece)) < count;) work(begin, std::min(count, begin + piece));
        } catch (...) {
            next = count;  // no more work for anybody
            const std::lock_guard lock(mutex);
            if (!failure) failure = std::current_exception();
        }
    };
    {
        std::vector<std::jthread> helpers;
        try {
            for (size_t i = 1; i < threads; i++) helpers.emplace_back(run);
        } catch (const std::system_error&) {  // no more threads: then with those that there are
        }
        run();
    }
    if (failure) std::rethrow_exception(failure);
}

Status parallel_try(size_t count, size_t piece, const std::function<Status(size_t, size_t)>& work, size_t most) {
    std::atomic<bool> failed{false};
    std::mutex mutex;
    Status result;
    parallel_for(
        count, piece,
        [&](size_t begin, size_t end) {
            if (failed) return;
            auto status = work(begin, end);
            if (status.ok()) return;
            const std::lock_guard lock(mutex);
            failed = true;
            result = std::move(status);
        },
        most);
    return result;
}

}  // namespace raypager
