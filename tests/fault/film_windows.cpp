// A film that does not fit into device memory is there in parts; the picture is the same, whatever else is small or stops.
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

class FilmInWindows : public support::SmallSceneFile {
protected:
    void SetUp() override {
        base_.width = 150;
        base_.height = 101;
        base_.spp = 3;
        base_.tuning.paths = 2048;
        base_.tuning.tile_size = 4;
    }
    // With room for some rows beside everything else.
    support::TestOptions in_windows(support::TestOptions options, uint32_t rows) const {
        options.memory_limit = 1;
        const auto refused = render(*file_, options, {});
        EXPECT_FALSE(refused.ok());
        const std::string text = refused.status().message(), before = "the smallest that would do is ";
        const size_t at = text.find(before);
        EXPECT_NE(at, std::string::npos) << text;
        uint64_t smallest = 0;
        for (size_t i = at + before.size(); i < text.size() && (std::isdigit(text[i]) || text[i] == ','); i++)
            if (text[i] != ',') smallest = 10 * smallest + static_cast<uint64_t>(text[i] - '0');
        options.memory_limit = smallest + uint64_t{rows} * options.width * 28;
        return options;
    }

    support::TestOptions base_;
};

TEST_F(FilmInWindows, is_the_same_in_all_ways) {
    for (const Traversal traversal : support::traversals())
        for (const bool layers : {false, true}) {
            if (layers && traversal != support::traversals().front()) continue;  // which would be more kernels, not other film
            support::TestOptions options = base_;
            options.tuning.traversal = traversal;
            if (layers) options.layers = FilmLayers(~0u);
            const auto whole = render(*file_, options, {});
            ASSERT_TRUE(whole.ok()) << whole.status().message();
            EXPECT_EQ(whole->report.film_rows, 101u);
            for (const uint32_t region : {0u, 700u}) {
                options.tuning.region = region;
                options.tuning.together = region ? 2 : 1;
                const support::TestOptions small = in_windows(options, region ? 50 : 20);
                const auto parts = render(*file_, small, {});
                ASSERT_TRUE(parts.ok()) << parts.status().message();
                EXPECT_LT(parts->report.film_rows, 50u);
                EXPECT_EQ(parts->report.film_rows % 4, 0u);
                EXPECT_LE(parts->report.peak.memory_bytes, small.memory_limit);
                EXPECT_EQ(parts->report.film_hash, whole->report.film_hash);
                EXPECT_EQ(parts->report.layers_hash, whole->report.layers_hash);
                EXPECT_TRUE(parts->report.complete);
            }
        }
}

// With other windows each time, or none.
TEST_F(FilmInWindows, goes_on_from_checkpoints) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto whole = render(*file_, base_, {});
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    base_.checkpoint.file = folder_.path() / "render.ckpt";
    uint32_t stops = 0;
    for (int trial = 0; trial < (support::thorough() ? 20 : 4); trial++) {
        std::filesystem::remove(base_.checkpoint.file);
        base_.tuning.region = trial % 2 ? 900 : 0;
        base_.tuning.together = 1 + trial % 3;
        for (uint32_t part = 0;; part++) {
            ASSERT_LT(part, 100u) << "no end in sight";
            support::TestOptions options = base_;
            options.checkpoint.resume = part > 0;
            options.tuning.paths = 1024u << random() % 3;
            if (random() % 4 > 0) options = in_windows(options, random() % 60);
            const auto result = render_rounds(*file_, options, part == 6 ? 0 : 1 + random() % 40);
            ASSERT_TRUE(result.ok()) << result.status().message();
            if (!result->report.complete) {
                stops++;
                continue;
            }
            ASSERT_EQ(result->report.film_hash, whole->report.film_hash) << "trial " << trial << " after " << part << " stops";
            break;
        }
    }
    EXPECT_GT(stops, 3u) << "the renders end before they are stopped";
}

// A stop leaves what is there, in time.
TEST_F(FilmInWindows, can_be_stopped_without_a_checkpoint) {
    support::TestOptions options = in_windows(base_, 12);
    options.stop_seconds = 0;
    const auto stopped = render_rounds(*file_, options, 20);
    ASSERT_TRUE(stopped.ok()) << stopped.status().message();
    EXPECT_FALSE(stopped->report.complete);
    EXPECT_GT(stopped->report.average_spp, 0);
    EXPECT_GT(stopped->report.unsampled, 0u);
    options.stop_seconds = 1e6;  // then every pixel gets a sample
    const auto soon = render_rounds(*file_, options, 20);
    ASSERT_TRUE(soon.ok()) << soon.status().message();
    EXPECT_EQ(soon->report.unsampled, 0u);
    EXPECT_LT(soon->report.average_spp, 3);
}

TEST_F(FilmInWindows, is_seen_in_snapshots) {
    support::TestOptions options = in_windows(base_, 12);
    options.snapshot_seconds = 1e-6;
    RenderCallbacks callbacks;
    double last = 0;
    uint32_t seen = 0;
    callbacks.snapshot = [&](const Image& image, const std::vector<FilmLayerImage>&, const RenderProgress& progress) -> Status {
        EXPECT_EQ(image.height, 101u);
        EXPECT_GE(progress.spp, last);
        last = progress.spp;
        seen++;
        return {};
    };
    const auto whole = render(*file_, base_, {}), parts = render(*file_, options, callbacks);
    ASSERT_TRUE(whole.ok() && parts.ok()) << parts.status().message();
    EXPECT_EQ(parts->report.film_hash, whole->report.film_hash);
    EXPECT_GT(seen, 10u);
    EXPECT_GT(last, 1);
}

// A session may begin anew with another view, or go on within other limits: it has the whole film wherever that fits, and says so where it does not.
TEST_F(FilmInWindows, is_whole_in_sessions_if_it_fits) {
    const auto blocks = Blocks::open(folder_.path() / "scene.rpb");
    ASSERT_TRUE(blocks.ok()) << blocks.status().message();
    const uint64_t film = uint64_t{base_.width} * base_.height * 32;
    for (const bool fits : {true, false}) {
        support::TestOptions options = in_windows(base_, 12);
        if (fits) options.memory_limit += film;
        auto session = Session::create(*blocks, options);
        ASSERT_TRUE(session.ok()) << session.status().message();
        ASSERT_TRUE(session->step(0).ok());
        const Status restarted = session->restart({{}, 60, 40}), limited = session->limit_geometry(0, 50);
        EXPECT_EQ(restarted.ok(), fits) << restarted.message();
        EXPECT_EQ(limited.ok(), fits) << limited.message();
        EXPECT_TRUE(fits || restarted.message().find("--memory-limit") != std::string::npos) << restarted.message();
        while (!session->done()) ASSERT_TRUE(session->step(0).ok());
        const auto result = session->finish();
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.film_rows < result->report.height, !fits);
        EXPECT_EQ(result->report.average_spp, base_.spp);
    }
}

TEST_F(FilmInWindows, is_refused_where_not_even_a_row_of_tiles_fits_into_a_buffer) {
    support::TestOptions options = base_;
    options.width = 1 << 20;
    options.height = 1500;
    options.tuning.tile_size = 1024;
    const auto refused = render(*file_, options, {});
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.status().message().find("--tile"), std::string::npos) << refused.status().message();
}

// What looks at the whole film before the end needs it on the device.
TEST_F(FilmInWindows, is_not_for_adaptive_sampling) {
    const support::TestOptions small = in_windows(base_, 12);
    for (const bool by_time : {false, true}) {
        support::TestOptions options = small;
        if (by_time)
            options.time_seconds = 1;
        else
            options.adaptive_error = 0.1;
        const auto refused = render(*file_, options, {});
        ASSERT_FALSE(refused.ok());
        EXPECT_NE(refused.status().message().find("the smallest that would do is"), std::string::npos) << refused.status().message();
    }
}

}  // namespace
}  // namespace raypager
