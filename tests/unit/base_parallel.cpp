// Work on all cores, or on fewer.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/parallel.hpp"

namespace raypager {
namespace {

// The threads that work when there are many short pieces.
size_t threads_at_work() {
    std::mutex mutex;
    std::set<std::thread::id> threads;
    parallel_for(64, 1, [&](size_t, size_t) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        const std::lock_guard lock(mutex);
        threads.insert(std::this_thread::get_id());
    });
    return threads.size();
}

TEST(Parallel, does_every_item_once) {
    for (const size_t piece : {0u, 1u, 7u, 1000u}) {
        std::vector<std::atomic<int>> done(100);
        parallel_for(done.size(), piece, [&](size_t begin, size_t end) {
            ASSERT_LE(end - begin, std::max<size_t>(piece, 1));
            for (size_t i = begin; i < end; i++) done[i]++;
        });
        for (const auto& count : done) EXPECT_EQ(count, 1);
    }
}

TEST(Parallel, with_as_many_threads_as_are_free) {
    EXPECT_EQ(helping_workers(), worker_count());
    {
        const WorkersAtMost two(2);
        EXPECT_EQ(helping_workers(), std::min<size_t>(2, worker_count()));
        EXPECT_LE(threads_at_work(), 2u);
        {
            const WorkersAtMost one(1);
            EXPECT_EQ(helping_workers(), 1u);
            EXPECT_EQ(threads_at_work(), 1u);
        }
        EXPECT_EQ(helping_workers(), std::min<size_t>(2, worker_count()));
    }
    EXPECT_EQ(helping_workers(), worker_count());
    parallel_for(2, 1, [](size_t, size_t) { EXPECT_EQ(helping_workers(), 1u) << "inside such work there is no more to be spread"; });
}

TEST(Parallel, an_exception_ends_the_work) {
    EXPECT_THROW(parallel_for(100, 1,
                              [](size_t begin, size_t) {
                                  if (begin == 50) throw std::runtime_error("fifty");
                              }),
                 std::runtime_error);
    EXPECT_EQ(helping_workers(), worker_count());
}

TEST(Parallel, a_failure_leaves_the_rest) {
    std::atomic<size_t> done{0};
    EXPECT_TRUE(parallel_try(100, 7, [&](size_t begin, size_t end) {
                    done += end - begin;
                    return Status();
                }).ok());
    EXPECT_EQ(done, 100u);
    done = 0;
    const Status status = parallel_try(100000, 1, [&](size_t begin, size_t) {
        if (begin == 50) return Status::failed("fifty");
        done++;
        std::this_thread::sleep_for(std::chrono::microseconds(10));
        return Status();
    });
    EXPECT_EQ(status.message(), "fifty");
    EXPECT_LT(done, 50000u);
}

}  // namespace
}  // namespace raypager
