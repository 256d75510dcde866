// What all cores make and one thread takes.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/in_order.hpp"

namespace raypager {
namespace {

constexpr size_t items = 500;

TEST(InOrder, is_taken_by_the_caller_whatever_is_made_first) {
    const auto caller = std::this_thread::get_id();
    for (const size_t ahead : {1u, 3u, 64u, 1000u}) {
        std::atomic<size_t> made{0};
        size_t taken = 0;
        const auto make = [&](size_t i) {
            if (i % 7 == 0) std::this_thread::sleep_for(std::chrono::microseconds(100));
            made++;
            return std::make_unique<size_t>(i);
        };
        const Status status = make_in_order(items, ahead, make, [&](size_t i, std::unique_ptr<size_t> item) -> Status {
            EXPECT_EQ(i, taken++);
            EXPECT_EQ(*item, i);
            EXPECT_EQ(std::this_thread::get_id(), caller);
            EXPECT_LE(made, i + ahead) << "more waits than may";
            return {};
        });
        EXPECT_TRUE(status.ok());
        EXPECT_EQ(taken, items);
    }
}

TEST(InOrder, ends_with_a_failure) {
    std::atomic<size_t> made{0};
    const Status status = make_in_order(
        items, 8, [&](size_t i) { return made++, i; }, [](size_t i, size_t) { return i == 20 ? Status::failed("twenty") : Status(); });
    EXPECT_EQ(status.message(), "twenty");
    EXPECT_LE(made, 28u);
}

TEST(InOrder, passes_exceptions_on) {
    const auto run = [](size_t make_throws, size_t take_throws) {
        (void)make_in_order(
            items, 8,
            [=](size_t i) {
                if (i == make_throws) throw std::runtime_error("made");
                return i;
            },
            [=](size_t i, size_t) -> Status {
                if (i == take_throws) throw std::logic_error("taken");
                return {};
            });
    };
    for (const size_t at : {size_t{0}, size_t{20}, items - 1}) {
        EXPECT_THROW(run(at, items), std::runtime_error) << at;
        EXPECT_THROW(run(items, at), std::logic_error) << at;
    }
    EXPECT_NO_THROW(run(items, items));
}

TEST(InOrder, goes_by_itself_within_work_of_all_cores) {
    std::atomic<size_t> taken{0};
    parallel_for(8, 1, [&](size_t, size_t) {
        const auto inside = std::this_thread::get_id();
        const auto make = [&](size_t i) {
            EXPECT_EQ(std::this_thread::get_id(), inside);
            return i;
        };
        EXPECT_TRUE(make_in_order(10, 2, make, [&](size_t, size_t) { return taken++, Status(); }).ok());
    });
    EXPECT_EQ(taken, 80u);
    EXPECT_TRUE(make_in_order(
                    0, 1, [](size_t i) { return i; }, [](size_t, size_t) { return Status::failed("there is nothing"); })
                    .ok());
}

}  // namespace
}  // namespace raypager
