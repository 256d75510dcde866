// The program, killed and stopped from outside while it renders. RAYPAGER_KILLS=50 kills it more often than CI has time for.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <thread>

#include "base/files.hpp"
#include "support/child_process.hpp"
#include "support/small_scene_file.hpp"

namespace raypager {
namespace {

using support::ChildProcess;
using support::ChildResult;
using support::patience;

class KilledRenders : public support::SmallSceneFile {
protected:
    void SetUp() override {
        const ChildResult whole = run({"-o", "whole.pfm", "--report", "whole.json"});
        ASSERT_EQ(whole.exit_code, 0) << errors();
        hash_ = film_hash("whole.json");
    }

    // A render of some hundred rounds.
    static std::vector<std::string> command(const std::vector<std::string>& options, const char* spp = "16") {
        std::vector<std::string> words = {"render", "scene.rpb", "--size", "96x64", "--spp", spp, "--paths", "4096", "--geometry-limit", "50%"};
        words.insert(words.end(), options.begin(), options.end());
        return words;
    }

    ChildResult run(const std::vector<std::string>& options, double kill_after = 0, int number = SIGKILL) {
        const auto begin = std::chrono::steady_clock::now();
        ChildProcess child(RAYPAGER_PROGRAM, command(options), folder_.path());
        ChildResult result;
        const bool kills = kill_after > 0 && !child.wait(kill_after, result);
        if (kills) child.signal(number);
        if (kills || kill_after == 0) {
            EXPECT_TRUE(child.wait(patience, result)) << "does not end";
        }
        if (!kills) seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        return result;
    }

    std::string text(const char* name) const {
        std::ifstream file(folder_.path() / name);
        std::ostringstream all;
        all << file.rdbuf();
        return all.str();
    }
    std::string errors() const { return text("stderr"); }
    std::string film_hash(const char* name) const {
        const auto report = nlohmann::json::parse(text(name), nullptr, false);
        return report.is_object() ? report["image"]["film_hash"].get<std::string>() : "no report";
    }
    bool exists(const char* name) const { return std::filesystem::exists(folder_.path() / name); }

    std::string hash_;
    double seconds_ = 0;  // of the last run that nothing stopped: the first may have had kernels to compile
};

TEST_F(KilledRenders, killed_at_random_moments_end_in_the_same_film) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const char* wanted = std::getenv("RAYPAGER_KILLS");
    const int kills = wanted ? std::atoi(wanted) : 10;
    int killed = 0, from_checkpoint = 0;
    for (int i = 0; i < kills; i++) {
        // Most of a run is start-up; a render that was over before it was killed leaves nothing to resume, so the next one begins anew.
        const double moment = seconds_ * std::uniform_real_distribution<double>(0.2, 1.2)(random);
        from_checkpoint += exists("kill.ckpt");
        const ChildResult result = run({"-o", "killed.pfm", "--checkpoint", "kill.ckpt", "--checkpoint-every", "0.001", "--resume"}, moment);
        if (result.signal == SIGKILL) {
            killed++;
            continue;
        }
        ASSERT_EQ(result.exit_code, 0) << errors();
        std::filesystem::remove(folder_.path() / "kill.ckpt");
    }
    const ChildResult last = run({"-o", "killed.pfm", "--checkpoint", "kill.ckpt", "--resume", "--report", "killed.json"});
    ASSERT_EQ(last.exit_code, 0) << errors();
    EXPECT_EQ(film_hash("killed.json"), hash_);
    EXPECT_GT(killed, 0);
    std::printf("%d of %d runs were killed, %d began from a checkpoint\n", killed, kills, from_checkpoint);
}

// SIGTERM and SIGINT end a render with a checkpoint at once, with a picture and an exit status of their own.
TEST_F(KilledRenders, stopped_by_a_signal_write_picture_and_checkpoint) {
    for (const int number : {SIGINT, SIGTERM}) {
        std::filesystem::remove(folder_.path() / "stop.ckpt");
        std::filesystem::remove(folder_.path() / "stopped.pfm");
        const std::vector<std::string> options = {"-o",   "stopped.pfm", "--checkpoint", "stop.ckpt", "--resume", "--checkpoint-every",
                                                  "0.01", "--report",    "stop.json"};
        ChildProcess child(RAYPAGER_PROGRAM, command(options, "20000"), folder_.path());
        ChildResult result;
        bool ended = false;
        for (int i = 0; i < 12000 && !ended && !exists("stop.ckpt"); i++) ended = child.wait(0.01, result);
        ASSERT_FALSE(ended) << errors();
        child.signal(number);
        ASSERT_TRUE(child.wait(patience, result));
        EXPECT_EQ(result.exit_code, 3) << errors();
        EXPECT_TRUE(exists("stopped.pfm"));
        EXPECT_NE(errors().find("stopped by a signal"), std::string::npos) << errors();
        EXPECT_NE(errors().find("--resume"), std::string::npos) << errors();
        EXPECT_NE(errors().find("stop.ckpt"), std::string::npos) << errors();
        const auto report = nlohmann::json::parse(text("stop.json"), nullptr, false);
        ASSERT_TRUE(report.is_object());
        EXPECT_EQ(report["image"]["complete"], false);
        EXPECT_LT(report["image"]["average_spp"], 20000);
    }
}

// The same without a checkpoint: within two seconds, with a picture, and a line at once that says what is going on.
TEST_F(KilledRenders, stopped_by_a_signal_write_a_picture_soon) {
    for (const bool twice : {false, true}) {
        std::filesystem::remove(folder_.path() / "stopped.pfm");
        ChildProcess child(RAYPAGER_PROGRAM, command({"-o", "stopped.pfm", "--log", "log.csv", "--report", "stop.json"}, "20000"), folder_.path());
        ChildResult result;
        bool ended = false;
        // A row of the log: rounds are under way.
        for (int i = 0; i < 12000 && !ended && (!exists("log.csv") || std::ranges::count(text("log.csv"), '\n') < 2); i++)
            ended = child.wait(0.01, result);
        ASSERT_FALSE(ended) << errors();
        child.signal(SIGINT);
        ended = child.wait(0.1, result);
        EXPECT_NE(errors().find("stopping"), std::string::npos) << errors();
        if (twice && !ended) child.signal(SIGINT);
        ASSERT_TRUE(ended || child.wait(patience, result));
        EXPECT_EQ(result.signal, 0);
        EXPECT_EQ(result.exit_code, 3) << errors();
        EXPECT_TRUE(exists("stopped.pfm"));
        EXPECT_NE(errors().find("stopped by a signal; the picture has"), std::string::npos) << errors();
        const auto report = nlohmann::json::parse(text("stop.json"), nullptr, false);
        ASSERT_TRUE(report.is_object());
        EXPECT_EQ(report["image"]["complete"], false);
        EXPECT_LT(report["image"]["average_spp"], 20000);
        std::filesystem::remove(folder_.path() / "log.csv");
    }
}

// The count is that of whole pictures; one that is not is named.
TEST_F(KilledRenders, stopped_turntables_count_their_pictures) {
    ChildProcess child(RAYPAGER_PROGRAM, command({"-o", "turn.pfm", "--turntable", "900"}, "64"), folder_.path());
    ChildResult result;
    bool ended = false;
    for (int i = 0; i < 12000 && !ended && !exists("turn_001.pfm"); i++) ended = child.wait(0.01, result);
    ASSERT_FALSE(ended) << errors();
    child.signal(SIGINT);
    ASSERT_TRUE(child.wait(patience, result));
    EXPECT_EQ(result.exit_code, 3) << errors();
    int there = 0;
    while (exists(fmt::format("turn_{:03}.pfm", there).c_str())) there++;
    const bool unfinished = errors().find("is not finished") != std::string::npos;
    EXPECT_EQ(errors().find(", stopped at ") != std::string::npos, unfinished) << errors();
    EXPECT_NE(errors().find(fmt::format("stopped by a signal after {} of 900 pictures", there - unfinished)), std::string::npos) << errors();
}

// What a sweep has finished is not made again.
TEST_F(KilledRenders, stopped_sweeps_go_on) {
    const std::vector<std::string> sweep = {"bench", "sweep", "scene.rpb", "-o",    "sweep",           "--limits", "100%,50%", "--repeats", "3",
                                            "--spp", "64",    "--size",    "96x64", "--reference-spp", "16",       "--paths",  "4096"};
    const auto rows = [&](const char* name) { return std::ranges::count(text(name), '\n'); };
    ChildProcess child(RAYPAGER_PROGRAM, sweep, folder_.path());
    ChildResult result;
    bool ended = false;
    for (int i = 0; i < 12000 && !ended && (!exists("sweep/sweep.runs") || rows("sweep/sweep.runs") < 2); i++) ended = child.wait(0.01, result);
    ASSERT_FALSE(ended) << errors();
    child.signal(SIGINT);
    ASSERT_TRUE(child.wait(patience, result));
    EXPECT_EQ(result.exit_code, 3) << errors();
    EXPECT_NE(errors().find("--resume"), std::string::npos) << errors();
    const auto kept = rows("sweep/sweep.runs");
    EXPECT_EQ(rows("sweep/sweep.csv"), kept) << "a row for each run behind the one with names";
    const std::string before = text("sweep/sweep.csv");
    const auto again = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words = sweep;
        words.insert(words.end(), more.begin(), more.end());
        ChildProcess second(RAYPAGER_PROGRAM, words, folder_.path());
        EXPECT_TRUE(second.wait(patience, result));
        return result.exit_code;
    };
    EXPECT_EQ(again({}), 1) << "would lose what there is";
    EXPECT_NE(errors().find("--resume"), std::string::npos) << errors();
    EXPECT_EQ(again({"--resume", "--max-depth", "2"}), 2) << errors();
    EXPECT_EQ(again({"--resume"}), 0) << errors();
    EXPECT_EQ(rows("sweep/sweep.csv"), 7);
    const auto json = nlohmann::json::parse(text("sweep/sweep.json"), nullptr, false);
    ASSERT_TRUE(json.is_object());
    EXPECT_EQ(json["runs"].size(), 6u);
    EXPECT_EQ(json["same_films"], true);
}

TEST_F(KilledRenders, without_a_platform_there_is_one_clear_line) {
    ChildProcess child(RAYPAGER_PROGRAM, command({"-o", "a.pfm"}), folder_.path(), {"OCL_ICD_VENDORS=" + folder_.path().string() + "/none"});
    ChildResult result;
    ASSERT_TRUE(child.wait(patience, result));
    EXPECT_EQ(result.exit_code, 1);
    const std::string told = errors();
    EXPECT_NE(told.find("no OpenCL platform found"), std::string::npos) << told;
    EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
    EXPECT_FALSE(exists("a.pfm"));
}

}  // namespace
}  // namespace raypager
