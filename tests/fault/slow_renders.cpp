// Renders that crawl say so.
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <vector>

#include "fault/tiny_blocks.hpp"

namespace raypager {
namespace {

using SlowRenders = TinyBlocks;

// No limit makes a render crawl without a word. It takes some seconds to be sure.
TEST_F(SlowRenders, say_what_limits_cost) {
    support::TestOptions options = options_;
    options.geometry_limit = 2 * uint64_t{file_->scene().largest_block(support::default_form())};
    options.host_limit = 1;
    options.spp = 1000;
    disk_.longest_delay_us = 20000;
    std::atomic<bool> stop{false};
    options.stop_now = &stop;
    std::vector<std::string> warnings;
    RenderCallbacks callbacks;
    callbacks.warning = [&](const std::string& text) {
        warnings.push_back(text);
        stop = true;
    };
    const auto result = render(*file_, options, callbacks);
    disk_.clear();
    ASSERT_TRUE(result.ok()) << result.status().message();
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("rays wait for blocks: the device has worked for "), std::string::npos) << warnings[0];
    const RenderReport::Seconds& seconds = result->report.seconds;
    EXPECT_GT(seconds.stall, 5.0 / 2);
    EXPECT_LE(seconds.stall + seconds.trace, seconds.render * 1.02);
}

// Where limits alone tell it, that is at the start.
TEST_F(SlowRenders, are_foretold_by_their_limits) {
    support::TestOptions options = options_;
    options.tuning.paths = 1;
    options.tuning.policy = PolicyKind::sweep;
    options.geometry_limit = uint64_t{file_->scene().largest_block(support::default_form())};
    options.spp = 1000;
    std::atomic<bool> stop{false};
    options.stop_now = &stop;
    std::vector<std::string> warnings;
    RenderCallbacks callbacks;
    callbacks.warning = [&](const std::string& text) { warnings.push_back(text); };
    callbacks.begins = [&] {
        EXPECT_EQ(warnings.size(), 1u);
        stop = true;
    };
    const auto result = render(*file_, options, callbacks);
    ASSERT_TRUE(result.ok()) << result.status().message();
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("with 1 path slot and "), std::string::npos) << warnings[0];
    EXPECT_FALSE(result->report.complete) << "was to be stopped at its start";
}

}  // namespace
}  // namespace raypager
