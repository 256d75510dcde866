// Renders that are stopped without a checkpoint: what they have done so far is a picture, soon, and nothing of it is wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <random>

#include "support/interrupted_render.hpp"
#include "support/small_scene_file.hpp"
#include "support/test_options.hpp"

namespace raypager {
namespace {

using support::render_rounds;

class StoppedRenders : public support::SmallSceneFile {
protected:
    void SetUp() override {
        options_.spp = 12;
        options_.tuning.together = 4;
        options_.width = 24;
        options_.height = 16;
        options_.tuning.paths = 64;
        options_.geometry_limit_percent = 50;
    }

    Image whole(uint32_t spp) const {
        support::TestOptions options = options_;
        options.spp = spp;
        auto result = render(*file_, options, {});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return std::move(result->image);
    }

    support::TestOptions options_;
};

// Samples of a pixel are the same in every render. So each pixel of a stopped one is that of a whole render with fewer samples.
TEST_F(StoppedRenders, end_at_once_with_every_pixel_seen) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::vector<Image> images;
    for (uint32_t spp = 1; spp <= options_.spp; spp++) images.push_back(whole(spp));
    const size_t pixels = images[0].values.size() / 3;
    for (const uint32_t region : {0u, 100u}) {
        options_.tuning.region = region;
        SCOPED_TRACE("regions of " + std::to_string(region));
        const auto all = render_rounds(*file_, options_, 0);
        ASSERT_TRUE(all.ok());
        const auto rounds = static_cast<uint32_t>(all->report.paging.rounds);
        uint32_t in_first_group = 0, in_later_group = 0;
        for (uint32_t trial = 0; trial < 12; trial++) {
            // Both groups of samples are met: the first trials stop early, each of the others in a sixth of the rounds of its own.
            const uint32_t stop_at = trial < 6 ? 1 + random() % (rounds / 4) : 1 + rounds * (trial - 6) / 6 + random() % (rounds / 6);
            options_.instruments.rounds_under_way = 1 + trial % 2;
            const auto stopped = render_rounds(*file_, options_, stop_at);
            ASSERT_TRUE(stopped.ok()) << stopped.status().message();
            EXPECT_EQ(stopped->report.complete, stopped->report.average_spp == options_.spp);
            EXPECT_EQ(stopped->report.unsampled, 0u);
            EXPECT_EQ(stopped->report.region, region);
            double sum = 0;
            for (size_t pixel = 0; pixel < pixels; pixel++) {
                const float* const value = &stopped->image.values[3 * pixel];
                uint32_t spp = 1;  // with which a whole render first has this value: later ones may, too, where a pixel is dark
                while (spp <= images.size() && !std::equal(value, value + 3, &images[spp - 1].values[3 * pixel])) spp++;
                ASSERT_LE(spp, images.size()) << "pixel " << pixel << " of a render stopped in round " << stop_at << " of " << rounds;
                sum += spp;
            }
            EXPECT_LE(sum / static_cast<double>(pixels), stopped->report.average_spp + 1e-9);
            const double spp = stopped->report.average_spp;
            in_first_group += spp < 3;
            in_later_group += spp > 3 && spp < 12;
        }
        EXPECT_GT(in_first_group, 0u) << "nothing was stopped in the first group";
        EXPECT_GT(in_later_group, 0u) << "nothing was stopped in a later group";
    }
}

TEST_F(StoppedRenders, that_are_long_go_region_by_region_unless_they_are_looked_at) {
    options_.spp = 64;
    options_.tuning.together = 0;
    const auto rendered = [&](const auto& change) {
        support::TestOptions options = options_;
        change(options);
        const auto result = render(*file_, options, {});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result.ok() ? result->report : RenderReport();
    };
    const RenderReport with_regions = rendered([](support::TestOptions&) {});
    const RenderReport at_once = rendered([](support::TestOptions& options) { options.tuning.region = 0; });
    EXPECT_EQ(with_regions.region, 2u) << "three paths for each of half of 64 slots";
    EXPECT_EQ(at_once.region, 0u);
    EXPECT_EQ(with_regions.film_hash, at_once.film_hash);
    // Regions are made of tiles that suit the device, unless the user has chosen them or all is resident.
    const auto tile = [&](const auto& change) {
        const RenderReport report = rendered([&](support::TestOptions& options) {
            options.tuning.profile = {{find_profile_field("region-tile"), 7}};
            change(options);
        });
        EXPECT_EQ(report.film_hash, at_once.film_hash);
        return report.tile_size;
    };
    EXPECT_EQ(tile([](support::TestOptions&) {}), 7u);
    EXPECT_EQ(tile([](support::TestOptions& options) { options.tuning.tile_size = 5; }), 5u);
    EXPECT_EQ(tile([](support::TestOptions& options) { options.tuning.region = 0; }), 16u);
    EXPECT_EQ(tile([](support::TestOptions& options) { options.geometry_limit_percent = 0; }), 16u);
    EXPECT_EQ(rendered([](support::TestOptions& options) { options.spp = 2; }).region, 0u) << "too short";
    EXPECT_EQ(rendered([](support::TestOptions& options) { options.time_seconds = 1000; }).region, 0u);
    EXPECT_EQ(rendered([](support::TestOptions& options) { options.snapshot_seconds = 1000; }).region, 0u);
    EXPECT_EQ(rendered([&](support::TestOptions& options) { options.checkpoint.file = folder_.path() / "render.ckpt"; }).region, 0u);
}

TEST_F(StoppedRenders, in_their_first_round_make_one_pass) {
    const auto stopped = render_rounds(*file_, options_, 1);
    ASSERT_TRUE(stopped.ok()) << stopped.status().message();
    EXPECT_EQ(stopped->report.average_spp, 1);
    EXPECT_EQ(stopped->image.values, whole(1).values);
}

// Where there is no time for a pass, pixels without a sample show what is around them, and the report counts them.
TEST_F(StoppedRenders, that_have_no_time_fill_in_what_is_missing) {
    options_.stop_seconds = 0;
    options_.width = 120;
    options_.height = 90;
    const auto stopped = render_rounds(*file_, options_, 12);
    ASSERT_TRUE(stopped.ok()) << stopped.status().message();
    EXPECT_FALSE(stopped->report.complete);
    EXPECT_LT(stopped->report.average_spp, 1);
    EXPECT_GT(stopped->report.average_spp, 0);
    EXPECT_GT(stopped->report.unsampled, 0u);
    EXPECT_LT(stopped->report.unsampled, 120u * 90);
    // The scene has a sky: nothing in it is black.
    size_t black = 0;
    for (size_t at = 0; at < stopped->image.values.size(); at += 3) black += stopped->image.values[at] == 0 && stopped->image.values[at + 1] == 0;
    EXPECT_LT(black, 120u * 90 / 20);
}

TEST_F(StoppedRenders, end_after_the_round_when_stopped_again) {
    std::atomic<bool> stop{false};
    options_.stop_now = &stop;
    options_.progress_seconds = 0;
    options_.spp = 4096;
    uint32_t ended = 0;
    RenderCallbacks callbacks;
    callbacks.progress = [&](const RenderProgress&) { stop = ++ended >= 20; };
    const auto stopped = render(*file_, options_, callbacks);
    ASSERT_TRUE(stopped.ok()) << stopped.status().message();
    EXPECT_FALSE(stopped->report.complete);
    EXPECT_LE(stopped->report.paging.rounds, 23u);
}

// A stop that comes when everything has begun takes nothing from the picture. How many rounds a render takes depends on when its blocks come, so
// not every stop after as many as another took comes that late.
TEST_F(StoppedRenders, at_the_very_end_are_complete) {
    options_.geometry_limit_percent = 0;
    options_.tuning.paths = 0;
    const auto all = render_rounds(*file_, options_, 0);
    ASSERT_TRUE(all.ok());
    for (int attempt = 0; attempt < 20; attempt++) {
        const auto stopped = render_rounds(*file_, options_, static_cast<uint32_t>(all->report.paging.rounds));
        ASSERT_TRUE(stopped.ok());
        if (!stopped->report.complete) continue;
        EXPECT_EQ(stopped->report.film_hash, all->report.film_hash);
        return;
    }
    FAIL() << "no stop was late enough";
}

}  // namespace
}  // namespace raypager
