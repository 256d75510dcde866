#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "render/watchdog.hpp"

namespace raypager {
namespace {

using std::chrono::milliseconds;

// Collects what is reported, and waits for it.
class Reports {
public:
    std::function<void(const std::string&)> sink() {
        return [this](const std::string& text) {
            const std::lock_guard lock(mutex_);
            texts_.push_back(text);
            changed_.notify_all();
        };
    }
    bool wait_for(size_t count, milliseconds patience = milliseconds(20000)) {
        std::unique_lock lock(mutex_);
        return changed_.wait_for(lock, patience, [&] { return texts_.size() >= count; });
    }
    std::vector<std::string> texts() {
        const std::lock_guard lock(mutex_);
        return texts_;
    }

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<std::string> texts_;
};

RoundState state(uint64_t achieved) {
    RoundState s;
    s.round = 17;
    s.ready_rays = 0;
    s.waiting_rays = 1234;
    s.requested_blocks = 2;
    s.most_wanted = {{5, 1000, 12, true}, {7, 234, 16, false}};
    s.resident_bytes = 4096;
    s.pool_bytes = 8192;
    s.achieved = achieved;
    return s;
}

TEST(Watchdog, TellsWhatARenderHangsOn) {
    Reports reports;
    Watchdog watchdog(
        0.02, [] { return std::string("asleep"); }, reports.sink());
    watchdog.round_ended(state(1));
    watchdog.doing("waiting for a block");
    // Where this thread was slow to say so, there are reports of before, the last of which may be in the making.
    const size_t before = reports.texts().size();
    ASSERT_TRUE(reports.wait_for(before + 2)) << "one report is not enough for a render that hangs on";
    const std::string text = reports.texts()[before + 1];
    for (const char* part :
         {"no progress for", "waiting for a block", "round 17", "1,234 rays for 2 blocks", "block 5 by 1,000 rays since round 12, loading",
          "block 7 by 234 rays since round 16;", "4.00 KiB of 8.00 KiB", "asleep"})
        EXPECT_NE(text.find(part), std::string::npos) << "no '" << part << "' in: " << text;
}

TEST(Watchdog, RoundsThatAchieveNothingAreNoProgress) {
    Reports reports;
    Watchdog watchdog(
        0.05, [] { return std::string(); }, reports.sink());
    for (int i = 0; i < 20000 && !reports.wait_for(1, milliseconds(1)); i++) watchdog.round_ended(state(1));
    EXPECT_TRUE(reports.wait_for(1, milliseconds(0)));
}

TEST(Watchdog, IsSilentWhileThereIsProgress) {
    Reports reports;
    {
        // Far more than this thread is kept off the processor on a busy machine.
        Watchdog watchdog(
            5, [] { return std::string(); }, reports.sink());
        for (uint64_t i = 0; i < 50; i++) {
            watchdog.round_ended(state(i));
            std::this_thread::sleep_for(milliseconds(2));
        }
    }
    EXPECT_TRUE(reports.texts().empty());
}

TEST(Watchdog, OffMeansOff) {
    Reports reports;
    {
        Watchdog watchdog(
            0, [] { return std::string(); }, reports.sink());
        watchdog.round_ended(state(1));
        std::this_thread::sleep_for(milliseconds(20));
    }
    EXPECT_TRUE(reports.texts().empty());
}

}  // namespace
}  // namespace raypager
