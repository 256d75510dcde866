// Promise 5: a render that was stopped, however often and with whatever limits it goes on, ends in the same film.
#include <gtest/gtest.h>

#include <random>

#include "support/device_scene.hpp"
#include "support/interrupted_render.hpp"
#include "support/small_scene_file.hpp"
#include "support/test_options.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

using support::render_rounds;

class CheckpointResume : public support::SmallSceneFile {
protected:
    void SetUp() override {
        base_.spp = 8;
        base_.tuning.paths = 128;
        const auto whole = render(*file_, base_, {});
        ASSERT_TRUE(whole.ok()) << whole.status().message();
        hash_ = whole->report.film_hash;
        base_.checkpoint.file = folder_.path() / "render.ckpt";
    }

    // Ways to go on that must not change the picture.
    std::vector<support::TestOptions> variants() const {
        std::vector<support::TestOptions> all(6, base_);
        all[1].geometry_limit_percent = 40;
        all[1].tuning.policy = PolicyKind::lru;
        all[2].tuning.paths = 64;
        all[2].geometry_limit = file_->scene().largest_block(support::default_form());
        all[3].tuning.paths = 3000;
        all[3].tuning.policy = PolicyKind::most_wanted;
        all[3].geometry_limit_percent = 60;
        all[4].tuning.paths = 1000;
        all[4].instruments.slab_bytes = file_->scene().largest_block(support::default_form()) + 64;
        all[5].instruments.rounds_under_way = 2;
        all[5].geometry_limit_percent = 50;
        return all;
    }

    support::TestOptions base_;
    uint64_t hash_ = 0;
};

// Samples of a pixel that begin together, stopped in any group; with other samples per pixel later, as far as those begun allow.
TEST_F(CheckpointResume, goes_on_in_groups_with_other_samples_a_pixel) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    support::TestOptions plain = base_;
    plain.checkpoint.file.clear();
    uint32_t went_on = 0;
    for (const uint32_t later_spp : {5u, 8u, 11u, 16u}) {
        plain.spp = later_spp;
        const auto whole = render(*file_, plain, {});
        ASSERT_TRUE(whole.ok()) << whole.status().message();
        for (int trial = 0; trial < (support::thorough() ? 5 : 2); trial++) {
            support::TestOptions options = base_;
            options.tuning.together = 4;
            options.tuning.region = 20 * trial;
            std::filesystem::remove(options.checkpoint.file);
            const auto stopped = render_rounds(*file_, options, 2 + random() % 30);
            ASSERT_TRUE(stopped.ok()) << stopped.status().message();
            options.checkpoint.resume = true;
            options.spp = later_spp;
            options.tuning.together = 1 + random() % 16;
            options.tuning.region = random() % 100;
            const auto resumed = render(*file_, options, {});
            if (!resumed.ok()) {
                EXPECT_NE(resumed.status().message().find("--spp"), std::string::npos) << resumed.status().message();
                continue;
            }
            went_on++;
            EXPECT_EQ(resumed->report.film_hash, whole->report.film_hash) << later_spp << " samples per pixel";
            EXPECT_TRUE(stopped->report.complete || resumed->report.together == 4u);
        }
    }
    EXPECT_GT(went_on, 4u);
}

// Tiles stay those that it began with, whatever a render within such limits would choose.
TEST_F(CheckpointResume, in_regions_keeps_its_tiles) {
    for (const bool limited_first : {false, true}) {
        std::filesystem::remove(base_.checkpoint.file);
        support::TestOptions options = base_;
        options.tuning.region = 20;
        options.tuning.profile = {{find_profile_field("region-tile"), 7}};
        options.geometry_limit = limited_first ? file_->scene().largest_block(support::default_form()) : 0;
        const auto stopped = render_rounds(*file_, options, 8);
        ASSERT_TRUE(stopped.ok()) << stopped.status().message();
        EXPECT_FALSE(stopped->report.complete);
        options.geometry_limit = limited_first ? 0 : file_->scene().largest_block(support::default_form());
        options.checkpoint.resume = true;
        const auto resumed = render(*file_, options, {});
        ASSERT_TRUE(resumed.ok()) << resumed.status().message();
        EXPECT_EQ(resumed->report.film_hash, hash_) << (limited_first ? "first within a limit" : "then within a limit");
    }
}

TEST_F(CheckpointResume, ends_in_the_same_film_after_stops_at_random_rounds) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const std::vector<support::TestOptions> ways = variants();
    uint32_t stops = 0;
    for (int trial = 0; trial < 8; trial++) {
        std::filesystem::remove(base_.checkpoint.file);
        for (uint32_t part = 0;; part++) {
            ASSERT_LT(part, 100u) << "no end in sight";
            support::TestOptions options = ways[random() % ways.size()];
            options.checkpoint.resume = part > 0;
            const uint32_t rounds = part == 4 ? 0 : 1 + random() % 20;
            const auto result = render_rounds(*file_, options, rounds);
            ASSERT_TRUE(result.ok()) << result.status().message();
            EXPECT_EQ(result->report.complete, result->report.average_spp == 8);
            if (!result->report.complete) {
                stops++;
                continue;
            }
            ASSERT_EQ(result->report.film_hash, hash_) << "trial " << trial << " after " << part << " stops";
            EXPECT_EQ(result->report.checkpoint.runs, part + 1);
            break;
        }
    }
    EXPECT_GT(stops, 8u) << "the renders end before they are stopped";
}

// A stop that finds the last round under way is none: the round is not thrown away, and the picture is whole.
TEST_F(CheckpointResume, is_not_needed_after_a_stop_in_the_last_round) {
    support::TestOptions options = base_;
    options.instruments.rounds_under_way = 2;
    options.checkpoint.file.clear();
    const auto whole = render(*file_, options, {});
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    options.checkpoint.file = base_.checkpoint.file;
    uint32_t complete = 0;
    // How many rounds it takes depends on when blocks come: on a busy machine perhaps some more.
    for (uint64_t rounds = whole->report.paging.rounds - 8; rounds < whole->report.paging.rounds || complete == 0; rounds++) {
        std::filesystem::remove(options.checkpoint.file);
        const auto result = render_rounds(*file_, options, static_cast<uint32_t>(rounds));
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.complete, result->report.average_spp == 8);
        EXPECT_EQ(result->report.complete, result->report.film_hash == hash_);
        complete += result->report.complete;
    }
    EXPECT_GT(complete, 0u);
}

// What rounds tell that end before a checkpoint is not forgotten, although nothing is paged after them.
TEST_F(CheckpointResume, is_written_after_every_round_while_others_are_under_way) {
    // With few paths a block is often wanted by one of them alone, and nobody else tells of it.
    for (const uint32_t paths : {16u, 64u, 128u, 1000u})
        for (const double percent : {30.0, 70.0}) {
            SCOPED_TRACE(testing::Message() << paths << " paths, " << percent << " %");
            support::TestOptions options = base_;
            std::filesystem::remove(options.checkpoint.file);
            options.tuning.paths = paths;
            options.instruments.rounds_under_way = 2;
            options.checkpoint.every_seconds = 1e-9;
            options.geometry_limit_percent = percent;
            const auto result = render(*file_, options, {});
            ASSERT_TRUE(result.ok()) << result.status().message();
            EXPECT_EQ(result->report.film_hash, hash_);
            EXPECT_GT(result->report.checkpoint.written, result->report.paging.rounds / 4);
        }
}

TEST_F(CheckpointResume, goes_on_with_paths_that_wait_for_blocks) {
    support::TestOptions options = base_;
    options.tuning.paths = 3000;  // nearly all samples are under way at once
    options.geometry_limit = file_->scene().largest_block(support::default_form());
    const auto stopped = render_rounds(*file_, options, 3);
    ASSERT_TRUE(stopped.ok()) << stopped.status().message();
    ASSERT_FALSE(stopped->report.complete);
    // The fewest slots: the list of what was under way is far longer than what the device holds of it.
    options.tuning.paths = 8;
    options.checkpoint.resume = true;
    const auto again = render_rounds(*file_, options, 10);
    ASSERT_TRUE(again.ok()) << again.status().message();
    ASSERT_FALSE(again->report.complete);
    const auto finished = render(*file_, options, {});
    ASSERT_TRUE(finished.ok()) << finished.status().message();
    EXPECT_EQ(finished->report.film_hash, hash_);
}

TEST_F(CheckpointResume, at_the_smallest_memory_limit_too) {
    support::TestOptions options = base_;
    options.memory_limit = 1000;
    const auto refused = render(*file_, options, {});
    ASSERT_FALSE(refused.ok());
    const std::string &message = refused.status().message(), key = "the smallest that would do is ";
    ASSERT_NE(message.find(key), std::string::npos) << message;
    options.memory_limit = std::stoull(message.substr(message.find(key) + key.size()));
    ASSERT_FALSE(render_rounds(*file_, options, 5)->report.complete);
    options.checkpoint.resume = true;
    const auto finished = render(*file_, options, {});
    ASSERT_TRUE(finished.ok()) << finished.status().message();
    EXPECT_EQ(finished->report.film_hash, hash_);
}

TEST_F(CheckpointResume, a_finished_render_can_be_extended) {
    support::TestOptions options = base_;
    options.spp = 3;
    ASSERT_TRUE(render(*file_, options, {}).ok());
    options.checkpoint.resume = true;
    const auto same = render(*file_, options, {});
    ASSERT_TRUE(same.ok()) << same.status().message();
    EXPECT_EQ(same->report.spp, 3u);
    EXPECT_NE(same->report.film_hash, hash_);
    const auto longer = render(*file_,
                               [&] {
                                   auto o = options;
                                   o.spp = 8;
                                   return o;
                               }(),
                               {});
    ASSERT_TRUE(longer.ok()) << longer.status().message();
    EXPECT_EQ(longer->report.film_hash, hash_);
    EXPECT_EQ(longer->report.rays.camera, 8 * 96u) << "finished samples were traced again";
}

TEST_F(CheckpointResume, after_a_time_limit) {
    support::TestOptions options = base_;
    options.time_seconds = 1e-9;
    const auto first = render(*file_, options, {});
    ASSERT_TRUE(first.ok()) << first.status().message();
    EXPECT_TRUE(first->report.complete);
    EXPECT_LT(first->report.spp, 8u);
    options.time_seconds = 0;
    options.checkpoint.resume = true;
    const auto second = render(*file_, options, {});
    ASSERT_TRUE(second.ok()) << second.status().message();
    EXPECT_EQ(second->report.film_hash, hash_);
}

// The number of the next sample says which have begun in the order of the first run alone.
TEST_F(CheckpointResume, in_the_order_in_which_it_began) {
    struct Order {
        uint32_t tile, together, region;
    };
    support::Turns turns(0, 2);
    for (const Order& first : {Order{16, 1, 0}, Order{5, 1, 0}, Order{16, 4, 0}, Order{3, 8, 0}, Order{16, 1, 33}, Order{16, 4, 40}})
        for (const Order& then : {Order{16, 1, 0}, Order{4, 8, 0}, Order{16, 4, 70}}) {
            if (!turns.take()) continue;
            std::filesystem::remove(base_.checkpoint.file);
            support::TestOptions options = base_;
            options.tuning.tile_size = first.tile;
            options.tuning.together = first.together;
            options.tuning.region = first.region;
            const auto stopped = render_rounds(*file_, options, 4);
            ASSERT_TRUE(stopped.ok()) << stopped.status().message();
            ASSERT_FALSE(stopped->report.complete);
            options.tuning.tile_size = then.tile;
            options.tuning.together = then.together;
            options.tuning.region = then.region;
            options.checkpoint.resume = true;
            const auto result = render(*file_, options, {});
            ASSERT_TRUE(result.ok()) << result.status().message();
            EXPECT_EQ(result->report.film_hash, hash_)
                << "tiles of " << first.tile << ", groups of " << first.together << ", regions of " << first.region;
            EXPECT_EQ(result->report.tile_size, first.tile);
            EXPECT_EQ(result->report.together, first.together);
            EXPECT_EQ(result->report.region, first.region);
        }
}

// Every pixel has a sample before regions get theirs, so the clock may end a render in the middle of one.
TEST_F(CheckpointResume, ends_regions_by_the_clock) {
    support::TestOptions options = base_;
    options.tuning.region = 20;
    options.tuning.together = 4;
    options.time_seconds = 1e-9;
    const auto first = render(*file_, options, {});
    ASSERT_TRUE(first.ok()) << first.status().message();
    EXPECT_GE(first->report.average_spp, 1);
    EXPECT_EQ(first->report.unsampled, 0u);
    options.time_seconds = 0;
    options.checkpoint.resume = true;
    const auto second = render(*file_, options, {});
    ASSERT_TRUE(second.ok()) << second.status().message();
    EXPECT_EQ(second->report.film_hash, hash_);
}

TEST_F(CheckpointResume, from_any_checkpoint_of_a_render) {
    support::TestOptions options = base_;
    options.tuning.paths = 64;
    options.checkpoint.every_seconds = 0;  // after each round
    uint32_t copies = 0;
    const auto kept = [&](uint32_t i) { return folder_.path() / ("copy" + std::to_string(i)); };
    RenderCallbacks callbacks;
    uint32_t rounds = 0;
    callbacks.progress = [&](const RenderProgress&) {
        if (rounds++ % 8 == 3) std::filesystem::copy_file(options.checkpoint.file, kept(copies++));
    };
    options.progress_seconds = 0;
    const auto whole = render(*file_, options, callbacks);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    EXPECT_EQ(whole->report.film_hash, hash_) << "writing checkpoints changes the film";
    EXPECT_GE(whole->report.checkpoint.written, rounds);
    ASSERT_GT(copies, 3u);
    options.checkpoint.every_seconds = 1e9;
    options.checkpoint.resume = true;
    for (uint32_t i = 0; i < copies; i++) {
        options.checkpoint.file = kept(i);
        const auto result = render(*file_, options, {});
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.film_hash, hash_) << "from checkpoint " << i;
    }
}

TEST_F(CheckpointResume, roulette_connection_too) {
    support::TestOptions options = base_;
    options.connection = Connection::roulette;
    options.checkpoint.file.clear();
    const uint64_t expected = render(*file_, options, {})->report.film_hash;
    options.checkpoint.file = base_.checkpoint.file;
    ASSERT_FALSE(render_rounds(*file_, options, 6)->report.complete);
    options.checkpoint.resume = true;
    options.geometry_limit_percent = 40;
    const auto result = render(*file_, options, {});
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.film_hash, expected);
}

TEST_F(CheckpointResume, starts_anew_without_a_file_and_overwrites_none) {
    support::TestOptions options = base_;
    options.checkpoint.resume = true;
    const auto first = render(*file_, options, {});
    ASSERT_TRUE(first.ok()) << first.status().message();
    EXPECT_EQ(first->report.film_hash, hash_);
    options.checkpoint.resume = false;
    const auto refused = render(*file_, options, {});
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.status().message().find("--resume"), std::string::npos) << refused.status().message();
}

}  // namespace
}  // namespace raypager
