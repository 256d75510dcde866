// A bake that is killed at any moment leaves nothing that a later run takes for good, and nothing at all once a later run has ended.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>

#include "support/child_process.hpp"
#include "support/sheet_scene.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::patience;
using support::read_file;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// 10, unless the environment wants more.
int kill_count() {
    const char* wanted = std::getenv("RAYPAGER_KILLS");
    return wanted ? std::atoi(wanted) : 10;
}

class KilledBake : public testing::Test {
protected:
    void SetUp() override { support::write_sheet_scene(folder_, 250); }

    // Exit status of the job; -1 if it was killed, which happens after so many seconds (0: never); -2 if another signal ended it.
    int run(const std::vector<std::string>& arguments, double kill_after = 0) const {
        support::ChildProcess child(RAYPAGER_PROGRAM, arguments, folder_.path());
        support::ChildResult result;
        const bool ended = kill_after > 0 && child.wait(kill_after, result);
        if (kill_after > 0 && !ended) child.signal(SIGKILL);
        if (!ended) {
            EXPECT_TRUE(child.wait(patience, result)) << "does not end";
        }
        return result.signal == SIGKILL ? -1 : result.signal != 0 ? -2 : result.exit_code;
    }

    // Starts the job kill_count() times and kills it at a random moment of its life, which takes about so long, or as long as one that ended
    // before its moment, if that was faster. after_each: looks at what it left. Returns how many were killed before they had ended.
    int kill_at_random(const std::vector<std::string>& arguments, double duration, const std::function<void()>& after_each) {
        const uint32_t seed = std::random_device{}();
        fmt::print("seed {}\n", seed);
        std::mt19937 random(seed);
        int killed = 0;
        for (int i = 0; i < kill_count(); i++) {
            const double seconds = std::uniform_real_distribution<double>(0, duration)(random);
            SCOPED_TRACE(fmt::format("seed {}, kill {} after {:.4f} s", seed, i, seconds));
            const auto begin = Clock::now();
            const int status = run(arguments, seconds);
            if (status == 0) duration = std::min(duration, seconds_since(begin));
            EXPECT_TRUE(status == -1 || status == 0) << status;
            killed += status == -1;
            after_each();
        }
        return killed;
    }

    size_t files_ending(const std::string& ending) const {
        size_t count = 0;
        for (const auto& file : folder_.files()) count += file.filename().string().ends_with(ending);
        return count;
    }

    std::string at(const std::string& name) const { return (folder_ / name).string(); }

    support::TemporaryFolder folder_;
};

TEST_F(KilledBake, LeavesTheOldFileOrTheNewOne) {
    const std::vector<std::string> job = {"bake", at("scene.pbrt"), "-o", at("a.rpb"), "--block-size", "16K"};
    const auto begin = Clock::now();
    ASSERT_EQ(run(job), 0);
    const double duration = seconds_since(begin);
    const std::string right = read_file(at("a.rpb"));
    const std::string old = "an older file\n";
    folder_.write("a.rpb", old);
    const int killed = kill_at_random(job, duration, [&] {
        const std::string now = read_file(at("a.rpb"));
        EXPECT_TRUE(now == old || now == right) << "a.rpb has " << now.size() << " bytes";
        folder_.write("a.rpb", old);
    });
    EXPECT_GT(killed, 0);
    const size_t left = files_ending(".tmp.rpb");
    fmt::print("{} of {} killed, {} temporary files left at the end\n", killed, kill_count(), left);
    EXPECT_LE(left, 1u) << "each bake removes what those before it left";
    ASSERT_EQ(run(job), 0);
    EXPECT_EQ(read_file(at("a.rpb")), right);
    EXPECT_EQ(files_ending(".tmp.rpb"), 0u);
}

// The tests below use the default OpenCL device.
using KilledBakeOnDevice = KilledBake;

TEST_F(KilledBakeOnDevice, LeavesACacheThatTheNextRenderUses) {
    const auto job = [&](const std::string& picture) {
        return std::vector<std::string>{"render", at("scene.pbrt"), "-o", at(picture), "--cache-dir", at("cache"), "--paths", "64"};
    };
    ASSERT_EQ(run(job("right.pfm")), 0);
    const auto begin = Clock::now();
    std::filesystem::remove_all(at("cache"));
    ASSERT_EQ(run(job("right.pfm")), 0);
    kill_at_random(job("a.pfm"), seconds_since(begin), [&] {
        // Now and then the scene changes as well, and the block file of the old one must not be taken for it, nor be kept.
        std::filesystem::last_write_time(at("sheet.ply"), std::filesystem::file_time_type::clock::now());
    });
    ASSERT_EQ(run(job("a.pfm")), 0);
    EXPECT_EQ(read_file(at("a.pfm")), read_file(at("right.pfm")));
    EXPECT_EQ(files_ending(".rpb"), 1u) << "old block files or temporary ones are left";
    EXPECT_EQ(files_ending(".tmp.pfm"), 0u);
}

}  // namespace
}  // namespace raypager
