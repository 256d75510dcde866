// Every operation on files of every job fails once: the n-th one for each n, with an error, a full disk or a transfer cut short. The
// job either says so in one line, exits with 1, leaves the old output whole and no temporary file; or it got on without (caches are
// best effort), and then its output is the right one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.hpp"
#include "render/checkpoint.hpp"
#include "support/failing_file_system.hpp"
#include "support/sheet_scene.hpp"
#include "support/temporary_folder.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

using support::read_file;

struct Outcome {
    int status = -1;
    std::string errors;
};

// The program inside this process, so that its files are those that fail.
Outcome run(const Arguments& arguments) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    Outcome outcome;
    outcome.status = run_program(arguments);
    outcome.errors = testing::internal::GetCapturedStderr();
    testing::internal::GetCapturedStdout();
    return outcome;
}

struct Error {
    const char* name;
    int number;  // 0: not an error but half of a transfer
};
constexpr Error errors[] = {{"EIO", EIO}, {"ENOSPC", ENOSPC}, {"short", 0}};

// How many operations lie between those that fail with the same error: each fails with one of them, in turn, or with all of them.
int every() { return support::thorough() ? 1 : static_cast<int>(std::size(errors)); }

bool is_temporary(const std::filesystem::path& path) { return path.filename().string().find(".tmp") != std::string::npos; }

class InjectedIo : public testing::Test {
protected:
    void SetUp() override {
        // A cache of kernels of its own, so that faults meet it (PoCL has to be told to use it). One a process: drivers remember where theirs is.
        static const support::TemporaryFolder cache;
        ::setenv("XDG_CACHE_HOME", cache.path().c_str(), 1);
        support::write_sheet_scene(folder_, 40);
    }

    std::string at(const std::string& name) const { return (folder_ / name).string(); }

    // Runs a job whose outputs are the files named, without a fault for the right contents, then with the faults; each time after
    // prepare().
    void expect_nothing_lost(
        const Arguments& arguments, const std::vector<std::string>& outputs, const std::function<void()>& prepare = [] {}) {
        prepare();
        const Outcome good = run(arguments);
        ASSERT_EQ(good.status, 0) << good.errors;
        std::vector<std::string> right;
        for (const std::string& name : outputs) right.push_back(comparable(name));
        int failed = 0, unharmed = 0;
        for (const Error& error : errors) {
            bool reached = true;
            for (int n = 1 + static_cast<int>(&error - errors) % every(); reached; n += every()) {
                SCOPED_TRACE(fmt::format("{}, operation {}", error.name, n));
                ASSERT_LT(n, 2000) << "no end of operations";
                for (const std::string& name : outputs) folder_.write(name, old_content);
                prepare();
                disk_.error_number = error.number;
                disk_.fail_any_in = n;
                const Outcome outcome = run(arguments);
                reached = disk_.fail_any_in <= 0;
                disk_.clear();
                check(outcome, outputs, right);
                if (HasFatalFailure()) return;
                (outcome.status == 0 ? unharmed : failed)++;
                EXPECT_TRUE(error.number != 0 || outcome.status == 0) << "a transfer cut short must go on";
            }
        }
        EXPECT_GT(failed, 0) << "no fault was ever met";
        RecordProperty("faults", failed + unharmed);
        fmt::print("{}: {} faults, {} ended in an error, {} did no harm\n", arguments.front(), failed + unharmed, failed, unharmed);
    }

    support::TemporaryFolder folder_;
    support::FailingFileSystem disk_;

private:
    static constexpr const char* old_content = "the old file\n";

    // Reports and logs differ in their times: of a report the figures that may not, of a log its first line. A checkpoint is good if it
    // can be gone on from.
    std::string comparable(const std::string& name) const {
        const std::string content = read_file(folder_ / name);
        if (name.ends_with(".ckpt")) {
            const auto checkpoint = CheckpointFile::open(folder_ / name);
            return checkpoint && checkpoint->read_film([](uint64_t, std::span<const uint32_t>) { return Status(); }) ? "good" : "damaged";
        }
        if (name.ends_with(".csv")) return content.substr(0, content.find('\n'));
        if (!name.ends_with(".json")) return content;
        const auto report = nlohmann::json::parse(content, nullptr, false);
        return report.is_object() ? report["image"].dump() : "no report";
    }

    void check(const Outcome& outcome, const std::vector<std::string>& outputs, const std::vector<std::string>& right) const {
        ASSERT_TRUE(outcome.status == 0 || outcome.status == 1) << outcome.status << outcome.errors;
        if (outcome.status == 1) {
            EXPECT_EQ(errors_said(outcome.errors), 1) << outcome.errors;
        }
        for (size_t i = 0; i < outputs.size(); i++) {
            const bool is_old = read_file(folder_ / outputs[i]) == old_content;
            const bool is_right = comparable(outputs[i]) == right[i];
            // A log grows: after a failure it may hold what it got.
            const bool may_be_old = outcome.status != 0 && (is_old || outputs[i].ends_with(".csv"));
            ASSERT_TRUE(is_right || may_be_old) << outputs[i] << " is neither old nor right";
        }
        for (const auto& file : folder_.files()) ASSERT_FALSE(is_temporary(file)) << file << " was left behind";
    }

    // Lines that are errors: neither warnings nor notes of what was done before.
    static long errors_said(const std::string& text) {
        long count = 0;
        std::istringstream lines(text);
        for (std::string line; std::getline(lines, line);)
            count += line.starts_with("raypager: ") && !line.starts_with("raypager: warning: ") && !line.starts_with("raypager: baked ");
        return count;
    }
};

TEST_F(InjectedIo, Bake) { expect_nothing_lost({"bake", at("scene.pbrt"), "-o", at("a.rpb"), "--block-size", "16K"}, {"a.rpb"}); }

TEST_F(InjectedIo, MakeScene) { expect_nothing_lost({"make-scene", "cornell", "-o", at("made"), "--triangles", "3000"}, {}); }

TEST_F(InjectedIo, InspectAndCompare) {
    ASSERT_EQ(run({"bake", at("scene.pbrt"), "-o", at("a.rpb"), "--block-size", "16K"}).status, 0);
    expect_nothing_lost({"inspect", at("a.rpb"), "--verify"}, {});
    folder_.write("a.pfm", std::string("Pf\n1 1\n-1.0\n") + std::string(4, '\0'));
    expect_nothing_lost({"compare", at("a.pfm"), at("a.pfm")}, {});
}

using InjectedIoOnDevice = InjectedIo;

TEST_F(InjectedIoOnDevice, RenderOfABlockFile) {
    ASSERT_EQ(run({"bake", at("scene.pbrt"), "-o", at("a.rpb"), "--block-size", "16K"}).status, 0);
    expect_nothing_lost({"render", at("a.rpb"), "-o", at("a.pfm"), "--geometry-limit", "1%", "--paths", "64", "--tune", "cache-kernels=1", "--log",
                         at("log.csv"), "--report", at("report.json")},
                        {"a.pfm", "log.csv", "report.json"});
}

// Baked on the way, into a cache.
TEST_F(InjectedIoOnDevice, RenderOfAScene) {
    expect_nothing_lost({"render", at("scene.pbrt"), "-o", at("a.pfm"), "--cache-dir", at("baked"), "--paths", "64", "--tune", "cache-kernels=1"},
                        {"a.pfm"}, [&] { std::filesystem::remove_all(folder_ / "baked"); });
}

// A checkpoint is read, written on the way and written at the end. What cannot be written is a warning; the file stays one to go on from.
TEST_F(InjectedIoOnDevice, RenderFromACheckpoint) {
    ASSERT_EQ(run({"bake", at("scene.pbrt"), "-o", at("a.rpb"), "--block-size", "16K"}).status, 0);
    Arguments job = {"render",          at("a.rpb"),    "-o",         at("a.pfm"),          "--paths", "32", "--tune",
                     "cache-kernels=1", "--checkpoint", at("a.ckpt"), "--checkpoint-every", "0.000001"};
    const Arguments one_sample = {"--spp", "1"}, two_samples = {"--spp", "2", "--resume"};
    Arguments first = job;
    first.insert(first.end(), one_sample.begin(), one_sample.end());
    ASSERT_EQ(run(first).status, 0);
    const std::string checkpoint = read_file(folder_ / "a.ckpt");
    job.insert(job.end(), two_samples.begin(), two_samples.end());
    expect_nothing_lost(job, {"a.pfm", "a.ckpt"}, [&] { folder_.write("a.ckpt", checkpoint); });
}

}  // namespace
}  // namespace raypager
