// Several devices share a render: the picture is that of one, whatever the limits are, through checkpoints, changes and devices that fail.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <future>
#include <mutex>
#include <random>
#include <string>

#include "raypager/raypager.hpp"
#include "render/render.hpp"
#include "support/failing_device.hpp"
#include "support/small_scene.hpp"
#include "support/temporary_folder.hpp"
#include "support/thorough.hpp"
#include "support/thread_peers.hpp"

namespace raypager {
namespace {

// PoCL looks here when the first platform is asked for.
[[maybe_unused]] const int three_devices = setenv("POCL_DEVICES", "pthread pthread pthread", 1);

class SeveralDevices : public testing::Test {
protected:
    void SetUp() override {
        const auto all = list_devices();
        ASSERT_TRUE(all.ok()) << all.status().message();
        for (const DeviceInfo& info : *all)
            if (info.platform == "Portable Computing Language") indices_.push_back(std::to_string(info.index));
        if (indices_.size() < 3) GTEST_SKIP() << "PoCL has fewer than three devices";
        BakeOptions bake_options;
        bake_options.block_bytes = 16 << 10;
        auto baked = bake(scene_, bake_options);
        ASSERT_TRUE(baked.ok()) << baked.status().message();
        ASSERT_GT(baked->blocks.count(), 4u);
        blocks_ = baked->blocks;
        options_.width = 48, options_.height = 32, options_.spp = 32;
        options_.geometry_limit_percent = 50;
        options_.tuning.paths = 2048;
    }

    std::string device(size_t count) const {
        std::string list;
        for (size_t i = 0; i < count; i++) list += (i ? "," : "") + indices_[i];
        return list;
    }
    RenderReport report(const RenderOptions& options) const {
        const auto result = render(*blocks_, options);
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result.ok() ? result->report : RenderReport();
    }
    uint64_t hash_of_one() {
        RenderOptions one = options_;
        one.device = device(1);
        return report(one).film_hash;
    }
    MeasuredRender run(const RenderOptions& options, const RenderInstruments& instruments, std::vector<std::string>* warnings = nullptr) const {
        RenderCallbacks callbacks;
        std::mutex mutex;
        callbacks.warning = [&](const std::string& text) {
            const std::lock_guard lock(mutex);
            if (warnings) warnings->push_back(text);
        };
        auto result = render(blocks_->source(), options, callbacks, instruments);
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result.ok() ? std::move(*result) : MeasuredRender();
    }

    support::TemporaryFolder folder_;
    const Scene scene_ = support::small_scene(30);
    std::vector<std::string> indices_;
    std::optional<Blocks> blocks_;
    RenderOptions options_;
};

TEST_F(SeveralDevices, draw_the_picture_of_one) {
    support::Turns turns(0, 5);
    for (const Traversal traversal : {Traversal::stream, Traversal::ray})
        for (const double percent : {100.0, 30.0, 0.001}) {
            options_.tuning.traversal = traversal;
            options_.geometry_limit_percent = percent;
            const uint64_t expected = hash_of_one();
            for (const size_t count : {2u, 3u}) {
                if (!turns.take()) continue;
                SCOPED_TRACE(testing::Message() << count << " devices at " << percent << " %");
                options_.device = device(count);
                const RenderReport shared = report(options_);
                EXPECT_EQ(shared.film_hash, expected);
                EXPECT_TRUE(shared.complete);
                ASSERT_EQ(shared.devices.size(), count);
                uint64_t samples = 0;
                for (const RenderReport::DeviceWork& work : shared.devices) samples += work.samples;
                EXPECT_EQ(samples, uint64_t{48} * 32 * 32);
                EXPECT_EQ(samples, shared.rays.camera);
                EXPECT_GT(std::count_if(shared.devices.begin(), shared.devices.end(), [](const auto& work) { return work.samples > 0; }), 1);
            }
        }
}

// As on GPUs, where the next round is started before one has ended.
TEST_F(SeveralDevices, end_with_two_rounds_under_way) {
    const uint64_t expected = hash_of_one();
    options_.device = device(2);
    for (const Traversal traversal : {Traversal::stream, Traversal::ray}) {
        options_.tuning.traversal = traversal;
        RenderInstruments instruments;
        instruments.rounds_under_way = 2;
        EXPECT_EQ(run(options_, instruments).report.film_hash, expected);
    }
}

TEST_F(SeveralDevices, keep_the_layers_of_one) {
    options_.layers = *parse_film_layers("all");
    options_.device = device(1);
    const RenderReport one = report(options_);
    options_.device = device(3);
    const RenderReport shared = report(options_);
    EXPECT_EQ(shared.film_hash, one.film_hash);
    EXPECT_EQ(shared.layers_hash, one.layers_hash);
}

TEST_F(SeveralDevices, sample_as_adaptively_as_one) {
    options_.adaptive_error = 0.05;
    options_.device = device(1);
    const RenderReport one = report(options_);
    ASSERT_LT(one.average_spp, 32);
    options_.device = device(2);
    const RenderReport shared = report(options_);
    EXPECT_EQ(shared.film_hash, one.film_hash);
    EXPECT_EQ(shared.average_spp, one.average_spp);
    // Slots that had nothing left to do in a stage are there for the next.
    options_.tuning.traversal = Traversal::ray;
    EXPECT_EQ(report(options_).film_hash, one.film_hash);
    options_.device = device(1);
    EXPECT_EQ(report(options_).film_hash, one.film_hash);
    // Between two stages a round is under way that has no rays.
    options_.tuning.traversal = Traversal::automatic;
    RenderInstruments instruments;
    instruments.rounds_under_way = 2;
    EXPECT_EQ(run(options_, instruments).report.film_hash, one.film_hash);
}

// As many as are at hand go on, each time other ones.
TEST_F(SeveralDevices, go_on_from_the_checkpoints_of_other_numbers_of_them) {
    for (const double adaptive : {0.0, 0.05}) {
        SCOPED_TRACE(adaptive);
        RenderOptions options = options_;
        options.adaptive_error = adaptive;
        options.device = device(1);
        const uint64_t expected = report(options).film_hash;
        options.checkpoint.file = folder_.path() / ("a" + std::to_string(adaptive) + ".ckpt");
        options.checkpoint.resume = true;
        size_t runs = 0;
        for (bool done = false; !done; runs++) {
            ASSERT_LT(runs, 200u);
            options.device = device(std::array<size_t, 4>{3, 1, 2, 3}[runs % 4]);
            options.tuning.paths = runs % 2 ? 512 : 1024;
            auto session = Session::create(*blocks_, options);
            ASSERT_TRUE(session.ok()) << session.status().message();
            // Adaptive ones end with some ten samples per pixel.
            const double until = static_cast<double>(runs + 1) * (support::thorough() ? 1 : 3);
            while (!session->done() && session->progress().spp < until) ASSERT_TRUE(session->step(0).ok());
            done = session->done();
            const auto result = session->finish();
            ASSERT_TRUE(result.ok()) << result.status().message();
            if (done) {
                EXPECT_EQ(result->report.film_hash, expected);
                EXPECT_EQ(result->report.checkpoint.runs, runs + 1);
            }
        }
        EXPECT_GT(runs, 2u);
    }
}

TEST_F(SeveralDevices, go_on_with_more_samples_than_before) {
    options_.spp = 96;
    const uint64_t expected = hash_of_one();
    options_.spp = 48;
    options_.checkpoint.file = folder_.path() / "b.ckpt";
    options_.checkpoint.resume = true;
    options_.device = device(3);
    report(options_);
    options_.spp = 96;
    options_.device = device(2);
    EXPECT_EQ(report(options_).film_hash, expected);
}

// Whichever it is, and whenever it is lost: before its first round, or after some of its work has gone into checkpoints.
TEST_F(SeveralDevices, do_the_work_of_one_that_fails) {
    const uint64_t plain = hash_of_one();
    options_.adaptive_error = 0.05;
    const uint64_t adaptive = hash_of_one();
    options_.device = device(3);
    constexpr uint32_t seed = 20261128;
    std::mt19937 random(seed);
    for (int trial = 0; trial < 24; trial++) {
        // Of every device, early and late, sampling evenly and adaptively, with much room and with little.
        if (!support::thorough() && trial % 5 != 0) continue;
        const bool adapts = trial % 2 == 1;
        const uint64_t expected = adapts ? adaptive : plain;
        const int failing = trial % 3;
        const auto command = static_cast<int64_t>(1 + random() % (trial < 6 ? 100 : trial < 12 ? 800 : 3000));
        SCOPED_TRACE(testing::Message() << "device " << failing << " is lost at command " << command << ", seed " << seed);
        RenderOptions options = options_;
        options.geometry_limit_percent = trial % 4 == 0 ? 100 : 10;
        options.adaptive_error = adapts ? 0.05 : 0;
        if (trial % 5 == 3) options.tuning.traversal = Traversal::ray;
        if (trial % 8 >= 4) options.host_limit = 1;  // room for two blocks, which all devices' loaders wait for
        if (trial >= 4) {
            options.checkpoint.file = folder_.path() / (std::to_string(trial) + ".ckpt");
            options.checkpoint.every_seconds = 0.01;
        }
        RenderInstruments instruments;
        const auto lost = std::make_shared<support::FailingDevice>();
        instruments.more_device_hooks.resize(2);
        (failing == 0 ? instruments.device_hooks : instruments.more_device_hooks[static_cast<size_t>(failing - 1)]) = lost;
        lost->lose_in = command;
        std::vector<std::string> warnings;
        const MeasuredRender result = run(options, instruments, &warnings);
        EXPECT_EQ(result.report.film_hash, expected);
        EXPECT_TRUE(result.report.complete);
        if (result.report.devices.size() == 3) continue;  // it had ended before
        ASSERT_EQ(result.report.devices.size(), 2u);
        const std::string name = "device " + indices_[static_cast<size_t>(failing)] + ": ";
        EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(), [&](const std::string& text) { return text.starts_with(name); }), 1);
        EXPECT_EQ(warnings.size(), 1u) << warnings.front() << "; " << warnings.back();
    }
}

TEST_F(SeveralDevices, end_with_an_error_when_all_have_failed) {
    options_.device = device(2);
    RenderInstruments instruments;
    for (const int64_t command : {150, 170}) {
        const auto lost = std::make_shared<support::FailingDevice>();
        lost->lose_in = command;
        if (!instruments.device_hooks)
            instruments.device_hooks = lost;
        else
            instruments.more_device_hooks = {lost};
    }
    RenderCallbacks callbacks;
    callbacks.warning = [](const std::string&) {};
    const auto result = render(blocks_->source(), options_, callbacks, instruments);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.status().exit_code(), 1);
    EXPECT_NE(result.status().message().find("OpenCL"), std::string::npos) << result.status().message();
}

TEST_F(SeveralDevices, go_without_one_that_has_no_memory) {
    const uint64_t expected = hash_of_one();
    options_.device = device(3);
    for (const size_t without : {0u, 2u}) {
        RenderInstruments instruments;
        const auto full = std::make_shared<support::FailingDevice>();
        full->memory_bytes = 1000;
        instruments.more_device_hooks.resize(2);
        (without == 0 ? instruments.device_hooks : instruments.more_device_hooks[without - 1]) = full;
        std::vector<std::string> warnings;
        const MeasuredRender result = run(options_, instruments, &warnings);
        EXPECT_EQ(result.report.film_hash, expected);
        EXPECT_EQ(result.report.devices.size(), 2u);
        ASSERT_FALSE(warnings.empty());
        EXPECT_NE(warnings.back().find("goes on without it"), std::string::npos) << warnings.back();
    }
}

TEST_F(SeveralDevices, move_and_change_limits_as_one) {
    const uint64_t expected = hash_of_one();
    RenderOptions moved = options_;
    moved.width = 32, moved.height = 24, moved.device = device(1);
    const uint64_t expected_moved = report(moved).film_hash;
    options_.device = device(2);
    auto session = Session::create(*blocks_, options_);
    ASSERT_TRUE(session.ok()) << session.status().message();
    ASSERT_TRUE(session->step(0).ok());
    ASSERT_TRUE(session->snapshot().ok());
    ASSERT_TRUE(session->limit_geometry(0, 20).ok());
    ASSERT_TRUE(session->step(0).ok());
    ASSERT_TRUE(session->restart({{}, 32, 24}).ok());
    while (!session->done()) {
        ASSERT_TRUE(session->step(0).ok());
        ASSERT_EQ(session->progress().devices.size(), 2u);
        ASSERT_TRUE(session->layers_at(3, 4).ok());
    }
    double spp = 0;
    ASSERT_TRUE(session->snapshot(&spp).ok());
    EXPECT_EQ(spp, 32);
    ASSERT_TRUE(session->restart({{}, 48, 32}).ok());
    ASSERT_TRUE(session->step(0).ok());
    ASSERT_TRUE(session->limit_geometry(0, 100).ok());
    while (!session->done()) ASSERT_TRUE(session->step(0).ok());
    const auto result = session->finish();
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.film_hash, expected);
    auto other = Session::create(*blocks_, options_);
    ASSERT_TRUE(other.ok());
    ASSERT_TRUE(other->step(0).ok());
    ASSERT_TRUE(other->restart({{}, 32, 24}).ok());
    while (!other->done()) ASSERT_TRUE(other->step(0).ok());
    const auto small = other->finish();
    ASSERT_TRUE(small.ok()) << small.status().message();
    EXPECT_EQ(small->report.film_hash, expected_moved);
}

// With room for two blocks in main memory, and in the middle of stages; a single device, too.
TEST_F(SeveralDevices, change_limits_in_little_room) {
    options_.adaptive_error = 0.05;
    options_.tuning.paths = 256;
    options_.host_limit = 1;
    const uint64_t expected = hash_of_one();
    for (const size_t count : {1u, 2u, 3u}) {
        options_.device = device(count);
        options_.geometry_limit_percent = 50;
        auto session = Session::create(*blocks_, options_);
        ASSERT_TRUE(session.ok()) << session.status().message();
        for (int step = 0; !session->done(); step++) {
            const Status status = session->step(0);
            ASSERT_TRUE(status.ok()) << status.message();
            if (step % (count == 1 ? 40 : 4) == 3 && !session->done()) {
                const Status changed = session->limit_geometry(0, step % 3 ? 20 : 60);
                ASSERT_TRUE(changed.ok()) << changed.message();
            }
        }
        const auto result = session->finish();
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.film_hash, expected) << count;
    }
}

TEST_F(SeveralDevices, end_early_with_a_sample_everywhere) {
    options_.spp = 60000;
    options_.time_seconds = 0.2;
    options_.device = device(3);
    const RenderReport by_time = report(options_);
    EXPECT_EQ(by_time.unsampled, 0u);
    EXPECT_GT(by_time.average_spp, 1);
    EXPECT_LT(by_time.average_spp, 60000);
    options_.time_seconds = 0;
    std::atomic<bool> stop{true};
    options_.stop = &stop;
    const RenderReport stopped = report(options_);
    EXPECT_FALSE(stopped.complete);
    EXPECT_LT(stopped.average_spp, 1000);
}

TEST_F(SeveralDevices, are_named_in_lists) {
    const auto refused = [&](const std::string& list) {
        options_.device = list;
        const auto result = render(*blocks_, options_);
        EXPECT_FALSE(result.ok()) << list;
        EXPECT_EQ(result.status().exit_code(), 2) << list;
        return result.status().message();
    };
    EXPECT_NE(refused(device(2) + "," + indices_[0]).find("named twice"), std::string::npos);
    EXPECT_NE(refused(indices_[0] + ",99").find("no device \"99\""), std::string::npos);
    refused(indices_[0] + ",");
    refused(",");
    options_.tuning.pool_place = PoolPlace::host;
    EXPECT_NE(refused(device(2)).find("one device"), std::string::npos);
    options_.tuning.pool_place = PoolPlace::device;
    options_.spp = 2;
    setenv("RAYPAGER_DEVICE", indices_[1].c_str(), 1);
    options_.device = "all";
    EXPECT_EQ(report(options_).devices.size(), 3u);
    setenv("RAYPAGER_DEVICE", device(2).c_str(), 1);
    options_.device = "";
    EXPECT_EQ(report(options_).devices.size(), 2u);
    unsetenv("RAYPAGER_DEVICE");
}

// Threads that are ranks to each other, with a device each.
TEST_F(SeveralDevices, of_several_processes_draw_the_picture_of_one) {
    for (const bool adaptive : {false, true}) {
        options_.adaptive_error = adaptive ? 0.1 : 0;
        const uint64_t expected = hash_of_one();
        support::PeerThreads group(3);
        std::vector<std::future<Result<RenderResult>>> ranks;
        for (uint32_t rank = 0; rank < 3; rank++) {
            RenderOptions own = options_;
            own.device = indices_[rank];
            own.peers = group.shared(rank);
            own.host_limit = blocks_->bytes(BlockForm::stored) / 5 * 2;  // not all blocks have room in memory
            ranks.push_back(std::async(std::launch::async, [own, this] { return render(*blocks_, own); }));
        }
        std::vector<RenderReport> reports;
        for (auto& rank : ranks) {
            const auto result = rank.get();
            ASSERT_TRUE(result.ok()) << result.status().message();
            reports.push_back(result->report);
        }
        EXPECT_EQ(reports[0].film_hash, expected);
        ASSERT_EQ(reports[0].ranks.size(), 3u);
        for (const RenderReport::Rank& rank : reports[0].ranks) {
            EXPECT_GT(rank.kept_bytes, 0u);
            EXPECT_LE(rank.kept_bytes, blocks_->bytes(BlockForm::stored) / 5 * 2);
            EXPECT_GT(rank.from_peers, 0u);
            EXPECT_GT(rank.from_file, 0u);
            EXPECT_EQ(rank.late + rank.damaged, 0u);
        }
    }
}

}  // namespace
}  // namespace raypager
