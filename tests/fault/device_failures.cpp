// Devices that are not there, have too little memory, or go away in mid-render: one clear line, and no work lost that was kept.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <random>
#include <thread>

#include "device/device.hpp"
#include "support/failing_device.hpp"
#include "support/interrupted_render.hpp"
#include "support/small_scene_file.hpp"
#include "support/test_options.hpp"

namespace raypager {
namespace {

class DeviceFailures : public support::SmallSceneFile {
protected:
    void SetUp() override {
        options_.instruments.device_hooks = device_;
        options_.spp = 4;
        options_.tuning.paths = 128;
        const auto whole = render(*file_, options_, {});
        ASSERT_TRUE(whole.ok()) << whole.status().message();
        hash_ = whole->report.film_hash;
        used_ = whole->report.peak.memory_bytes;
        callbacks_.warning = [this](const std::string& text) {
            const std::lock_guard lock(mutex_);
            warnings_.push_back(text);
        };
    }

    // One line that contains all of these.
    static void expect_message(const std::string& message, const std::vector<std::string>& named) {
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        for (const std::string& text : named) EXPECT_NE(message.find(text), std::string::npos) << "no '" << text << "' in: " << message;
    }

    const std::shared_ptr<support::FailingDevice> device_ = std::make_shared<support::FailingDevice>();
    support::TestOptions options_;
    RenderCallbacks callbacks_;
    uint64_t hash_ = 0, used_ = 0;
    std::mutex mutex_;
    std::vector<std::string> warnings_;
};

TEST_F(DeviceFailures, none_there) {
    device_->no_platform = true;
    auto result = render(*file_, options_, {});
    ASSERT_FALSE(result.ok());
    expect_message(result.status().message(), {"no OpenCL platform", "install"});
    EXPECT_EQ(result.status().exit_code(), 1);
    device_->clear();
    device_->no_device = true;
    result = render(*file_, options_, {});
    ASSERT_FALSE(result.ok());
    expect_message(result.status().message(), {"no usable device"});
    EXPECT_EQ(result.status().exit_code(), 1);
}

TEST_F(DeviceFailures, kernels_that_do_not_build) {
    device_->fail_builds = true;
    const auto result = render(*file_, options_, {});
    ASSERT_FALSE(result.ok());
    expect_message(result.status().message(), {".cl", "does not build", "CL_BUILD_PROGRAM_FAILURE"});
}

// Other programs hold memory that the limit counts as ours.
TEST_F(DeviceFailures, memory_refused_leads_to_a_smaller_pool) {
    device_->memory_bytes = used_ * 3 / 4;
    const auto result = render(*file_, options_, callbacks_);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.film_hash, hash_);
    EXPECT_LE(result->report.peak.memory_bytes, used_ * 3 / 4);
    EXPECT_GT(result->report.paging.evictions, 0u) << "the pool is as large as before";
    ASSERT_FALSE(warnings_.empty());
    expect_message(warnings_[0], {"CL_MEM_OBJECT_ALLOCATION_FAILURE", "trying with"});
}

TEST_F(DeviceFailures, too_little_memory_is_refused_with_the_least_that_would_do) {
    options_.memory_limit = 1000;
    const std::string key = "the smallest that would do is ", message = render(*file_, options_, {}).status().message();
    ASSERT_NE(message.find(key), std::string::npos) << message;
    const std::string least = message.substr(message.find(key), message.find(' ', message.find(key) + key.size()) - message.find(key));
    options_.memory_limit = 0;
    // What is planned for is up to some hundred bytes more than what is then allocated: sizes are rounded up.
    device_->memory_bytes = std::stoull(least.substr(key.size())) / 20 * 19;
    const auto result = render(*file_, options_, callbacks_);
    ASSERT_FALSE(result.ok());
    expect_message(result.status().message(), {least, "refused"});
}

TEST_F(DeviceFailures, lost_in_mid_render_keeps_the_checkpoint) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    options_.checkpoint.file = folder_.path() / "render.ckpt";
    options_.checkpoint.every_seconds = 0;
    options_.geometry_limit_percent = 50;
    options_.progress_seconds = 0;
    uint32_t losses = 0;
    bool done = false;
    for (int part = 0; part < 100 && !done; part++) {
        options_.checkpoint.resume = part > 0;
        uint32_t rounds = 0;
        callbacks_.progress = [&](const RenderProgress&) {
            // The first checkpoint has been written by then.
            if (rounds++ == 1) device_->lose_in = 1 + random() % (part < 3 ? 20 : 400);
        };
        const auto result = render(*file_, options_, callbacks_);
        device_->clear();
        if (result.ok()) {
            EXPECT_EQ(result->report.film_hash, hash_);
            done = true;
        } else {
            losses++;
            EXPECT_EQ(result.status().exit_code(), 1);
            expect_message(result.status().message(), {"CL_INVALID_COMMAND_QUEUE", "device is lost", "--resume", "render.ckpt"});
        }
    }
    EXPECT_TRUE(done);
    EXPECT_GT(losses, 2u);
}

TEST_F(DeviceFailures, lost_before_anything_was_kept) {
    options_.progress_seconds = 0;
    callbacks_.progress = [&](const RenderProgress&) { device_->lose_in = 1; };
    const auto result = render(*file_, options_, callbacks_);
    ASSERT_FALSE(result.ok());
    expect_message(result.status().message(), {"device is lost"});
    EXPECT_EQ(result.status().message().find("--resume"), std::string::npos) << result.status().message();
}

// The watchdog tells what a render without progress waits for, and goes on telling; the render ends well once its blocks come.
TEST_F(DeviceFailures, a_loader_that_does_not_deliver_is_told) {
    options_.stall_seconds = 0.05;
    device_->hold_uploads = true;
    // On a busy machine a thread may be kept off the processor for as long, before it waits or has begun to load: that is told, too.
    const auto is_of_the_loader = [](const std::string& text) {
        return text.find("waiting for a block") != std::string::npos && text.find("being brought for") != std::string::npos;
    };
    ptrdiff_t told = 0;
    std::thread release([&] {
        for (int i = 0; i < 3000 && told < 2; i++) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            const std::lock_guard lock(mutex_);
            told = std::count_if(warnings_.begin(), warnings_.end(), is_of_the_loader);
        }
        device_->hold_uploads = false;
    });
    const auto result = render(*file_, options_, callbacks_);
    release.join();
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.film_hash, hash_);
    ASSERT_GE(told, 2) << "not told twice";
    expect_message(*std::find_if(warnings_.begin(), warnings_.end(), is_of_the_loader),
                   {"no progress for", "waiting for a block", "most wanted: block", "loading", "pool:", "loads to begin", "being brought for",
                    "still going on"});
}

TEST_F(DeviceFailures, a_render_with_progress_is_not_talked_about) {
    options_.stall_seconds = 20;  // far more than the whole render takes, even under a simulator's eye
    const auto result = render(*file_, options_, callbacks_);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_TRUE(warnings_.empty()) << warnings_[0];
}

TEST_F(DeviceFailures, a_film_that_the_device_cannot_hold_is_refused_with_the_number) {
    options_.width = options_.height = 16384;
    options_.adaptive_error = 0.1;  // which takes the whole film
    options_.memory_limit = uint64_t{1} << 30;
    const auto result = render(*file_, options_, {});
    ASSERT_FALSE(result.ok());
    // "... the smallest that would do is N", or "... the film needs N bytes at once" where the device allocates less.
    const std::string& message = result.status().message();
    size_t at = message.find("the smallest that would do is ");
    if (at == std::string::npos) at = message.find("the film needs ");
    ASSERT_NE(at, std::string::npos) << message;
    EXPECT_GE(std::stoull(message.substr(message.find_first_of("0123456789", at))), uint64_t{1} << 33) << message;
}

}  // namespace
}  // namespace raypager
