// The public library: sessions that are driven from outside end in the picture of a render from start to end.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "raypager/raypager.hpp"
#include "support/small_scene.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

class Sessions : public testing::Test {
protected:
    void SetUp() override {
        BakeOptions bake_options;
        bake_options.block_bytes = 16 << 10;
        auto baked = bake(scene_, bake_options);
        ASSERT_TRUE(baked.ok()) << baked.status().message();
        EXPECT_EQ(baked->summary.blocks, baked->blocks.count());
        ASSERT_GT(baked->blocks.count(), 4u);
        blocks_ = baked->blocks;
        options_.width = 48, options_.height = 32, options_.spp = 8;
        options_.geometry_limit_percent = 50;
        options_.tuning.paths = 2048;
        const auto whole = render(*blocks_, options_);
        ASSERT_TRUE(whole.ok()) << whole.status().message();
        EXPECT_TRUE(whole->report.complete);
        hash_ = whole->report.film_hash;
    }

    Session session(const RenderOptions& options) const {
        auto created = Session::create(*blocks_, options);
        EXPECT_TRUE(created.ok()) << created.status().message();
        return std::move(*created);
    }

    // To the end, a round at a time.
    static Result<RenderResult> finish(Session& session) {
        while (!session.done()) RAYPAGER_TRY(session.step(0));
        return session.finish();
    }

    support::TemporaryFolder folder_;
    const Scene scene_ = support::small_scene(30);
    std::optional<Blocks> blocks_;
    RenderOptions options_;
    uint64_t hash_ = 0;
};

TEST_F(Sessions, blocks_in_memory_and_in_a_file_are_the_same) {
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    const auto path = folder_.path() / "scene.rpb";
    ASSERT_TRUE(bake(scene_, bake_options, path).ok());
    const auto file = Blocks::open(path);
    ASSERT_TRUE(file.ok()) << file.status().message();
    EXPECT_EQ(file->triangles(), blocks_->triangles());
    EXPECT_EQ(file->bytes(BlockForm::wide), blocks_->bytes(BlockForm::wide));
    EXPECT_EQ(file->bounds(1), blocks_->bounds(1));
    const auto result = render(*file, options_);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.film_hash, hash_);
}

TEST_F(Sessions, stepping_and_looking_change_nothing) {
    Session stepped = session(options_);
    double fraction = 0;
    for (int i = 0; !stepped.done(); i++) {
        const Status status = stepped.step(0);
        ASSERT_TRUE(status.ok()) << status.message();
        EXPECT_GE(stepped.progress().fraction, fraction);
        fraction = stepped.progress().fraction;
        if (i % 3 == 0) {
            const auto picture = stepped.snapshot();
            ASSERT_TRUE(picture.ok()) << picture.status().message();
            EXPECT_EQ(picture->values.size(), 48u * 32 * 3);
        }
    }
    const auto result = stepped.finish();
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_TRUE(result->report.complete);
    EXPECT_EQ(result->report.film_hash, hash_);
}

TEST_F(Sessions, a_checkpoint_is_written_when_asked_for_and_gone_on_from) {
    options_.checkpoint.file = folder_.path() / "a.ckpt";
    {
        Session first = session(options_);
        ASSERT_TRUE(first.step(0).ok());
        ASSERT_TRUE(first.checkpoint().ok());
        ASSERT_TRUE(first.step(0).ok());  // what comes after is lost with the session
    }
    options_.checkpoint.resume = true;
    Session second = session(options_);
    const auto result = finish(second);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.checkpoint.runs, 2u);
    EXPECT_EQ(result->report.film_hash, hash_);
    options_.checkpoint = {};
    Session without = session(options_);
    EXPECT_EQ(without.checkpoint().kind(), ErrorKind::usage);
}

TEST_F(Sessions, cancelling_from_another_thread_keeps_what_there_is) {
    options_.spp = 60000;
    Session cancelled = session(options_);
    ASSERT_TRUE(cancelled.step(0).ok());
    std::thread other([&] { cancelled.cancel(); });
    const Status status = cancelled.step(1e9);
    other.join();
    ASSERT_TRUE(status.ok()) << status.message();
    EXPECT_TRUE(cancelled.done());
    const auto result = cancelled.finish();
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_FALSE(result->report.complete);
    EXPECT_LT(result->report.average_spp, 60000);
    EXPECT_EQ(result->image.width, 48u);
}

// Whoever has seen enough need not cancel.
TEST_F(Sessions, may_be_finished_at_any_time) {
    options_.spp = 60000;
    Session early = session(options_);
    ASSERT_TRUE(early.step(0).ok());
    const auto result = early.finish();
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_FALSE(result->report.complete);
    EXPECT_EQ(result->image.values.size(), 48u * 32 * 3);
}

// Rays one by one, and in streams where the device has them.
class SessionsOfEitherWay : public Sessions, public testing::WithParamInterface<Traversal> {
protected:
    void SetUp() override {
        options_.tuning.traversal = GetParam();
        Sessions::SetUp();
    }
};
INSTANTIATE_TEST_SUITE_P(ways, SessionsOfEitherWay, testing::Values(Traversal::automatic, Traversal::ray),
                         [](const auto& info) { return info.param == Traversal::ray ? "ray" : "automatic"; });

// Whoever watches sees all of the picture early, and gets the same one.
TEST_P(SessionsOfEitherWay, coarse_first_ends_in_the_same_film) {
    options_.coarse_first = true;
    options_.width = 300, options_.height = 200, options_.spp = 3;
    auto plain = options_;
    plain.coarse_first = false;
    const auto whole = render(*blocks_, plain);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    for (const uint32_t paths : {512u, 4096u, 100000u}) {
        options_.tuning.paths = paths;
        Session coarse = session(options_);
        double first = 0;
        for (int i = 0; !coarse.done(); i++) {
            ASSERT_TRUE(coarse.step(0).ok());
            if (i == 0) first = coarse.progress().spp;
            EXPECT_LE(coarse.progress().fraction, 1);
        }
        EXPECT_GT(first, 0) << paths;
        EXPECT_LE(first, 0.25) << paths;  // every other point in both directions
        const auto result = coarse.finish();
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_TRUE(result->report.complete);
        EXPECT_EQ(result->report.film_hash, whole->report.film_hash) << paths;
    }
}

TEST_F(Sessions, coarse_first_stops_like_any_other) {
    options_.coarse_first = true;
    options_.width = 300, options_.height = 200, options_.spp = 60000;
    options_.tuning.paths = 512;
    for (const double seconds : {0.0, 0.01, 0.3}) {
        Session stopped = session(options_);
        ASSERT_TRUE(stopped.step(seconds).ok());
        stopped.cancel();
        ASSERT_TRUE(stopped.step(1e9).ok());
        const auto result = stopped.finish();
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_FALSE(result->report.complete);
    }
    options_.time_seconds = 0.05;
    const auto timed = render(*blocks_, options_);
    ASSERT_TRUE(timed.ok()) << timed.status().message();
    EXPECT_EQ(timed->report.unsampled, 0u);
}

TEST_P(SessionsOfEitherWay, begin_anew_with_another_view_as_if_created_with_it) {
    for (const bool coarse : {false, true}) {
        options_.coarse_first = coarse;
        Session moved = session(options_);
        ASSERT_TRUE(moved.step(0.02).ok());
        SessionView view;
        view.camera = blocks_->camera();
        view.camera->eye.x += 0.25f;
        view.width = 24, view.height = 20;
        auto changed = options_;
        changed.coarse_first = false;
        changed.camera = view.camera;
        changed.width = view.width, changed.height = view.height;
        const auto expected = render(*blocks_, changed);
        ASSERT_TRUE(expected.ok()) << expected.status().message();
        ASSERT_TRUE(moved.restart(view).ok());
        EXPECT_EQ(moved.progress().rays, 0u);
        EXPECT_EQ(moved.progress().loads, 0u);
        EXPECT_GT(moved.progress().resident_bytes, 0u);  // blocks stay
        while (!moved.done()) ASSERT_TRUE(moved.step(0).ok());
        // And back, once it is done.
        view.camera = blocks_->camera();
        view.width = 48, view.height = 32;
        ASSERT_TRUE(moved.restart(view).ok());
        EXPECT_FALSE(moved.done());
        const auto back = finish(moved);
        ASSERT_TRUE(back.ok()) << back.status().message();
        EXPECT_EQ(back->report.film_hash, hash_);
        EXPECT_EQ(back->report.rays.camera, 48u * 32 * 8);
        Session again = session(options_);
        ASSERT_TRUE(again.step(0.02).ok());
        view.camera = changed.camera;
        view.width = 24, view.height = 20;
        ASSERT_TRUE(again.restart(view).ok());
        const auto result = finish(again);
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.film_hash, expected->report.film_hash);
    }
}

TEST_F(Sessions, what_cannot_be_shown_leaves_them_as_they_are) {
    Session kept = session(options_);
    ASSERT_TRUE(kept.step(0).ok());
    SessionView large;
    large.width = 49, large.height = 32;
    EXPECT_EQ(kept.restart(large).kind(), ErrorKind::usage);
    const Status small = kept.limit_geometry(1, 0);
    ASSERT_FALSE(small.ok());
    EXPECT_NE(small.message().find("geometry-limit"), std::string::npos) << small.message();
    const auto result = finish(kept);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.film_hash, hash_);
}

TEST_P(SessionsOfEitherWay, limits_change_while_they_run_and_the_picture_does_not) {
    for (const bool coarse : {false, true})
        for (const double adaptive : {0.0, 0.05}) {
            options_.coarse_first = coarse;
            options_.adaptive_error = adaptive;
            options_.spp = adaptive > 0 ? 32 : 8;
            const auto whole = render(*blocks_, options_);
            ASSERT_TRUE(whole.ok()) << whole.status().message();
            Session limited = session(options_);
            // Paths under way begin anew each time, so it must come to an end.
            const double limits[] = {100, 1, 40, 100, 5};
            size_t changes = 0;
            for (int i = 0; !limited.done(); i++) {
                ASSERT_TRUE(limited.step(0).ok());
                if (i % 7 != 6 || changes == std::size(limits)) continue;
                const Status changed = limited.limit_geometry(0, limits[changes++]);
                ASSERT_TRUE(changed.ok()) << changed.message();
            }
            EXPECT_GE(changes, 3u);
            EXPECT_GT(limited.progress().loads, blocks_->count());
            const auto result = limited.finish();
            ASSERT_TRUE(result.ok()) << result.status().message();
            EXPECT_TRUE(result->report.complete);
            EXPECT_EQ(result->report.film_hash, whole->report.film_hash) << "coarse " << coarse << ", adaptive " << adaptive;
        }
}

// Memory is divided for the largest view, whichever is shown when limits change.
TEST_F(Sessions, limits_that_change_while_the_picture_is_small_leave_room_for_large_ones) {
    options_.width = 400, options_.height = 300;
    options_.spp = 1;
    options_.memory_limit = 100000;
    const auto refused = Session::create(*blocks_, options_);
    ASSERT_FALSE(refused.ok());
    const std::string key = "the smallest that would do is ", &message = refused.status().message();
    ASSERT_NE(message.find(key), std::string::npos) << message;
    options_.memory_limit = std::stoull(message.substr(message.find(key) + key.size())) + 200000;
    options_.memory_limit += 400 * 300 * 32;  // for the film as a whole, without which the view cannot change
    options_.geometry_limit_percent = 0;
    const auto whole = render(*blocks_, options_);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    Session changed = session(options_);
    ASSERT_TRUE(changed.step(0).ok());
    ASSERT_TRUE(changed.restart({std::nullopt, 40, 30}).ok());
    ASSERT_TRUE(changed.step(0).ok());
    ASSERT_TRUE(changed.limit_geometry(0, 0).ok());
    ASSERT_TRUE(changed.step(0).ok());
    const Status large = changed.restart({std::nullopt, 400, 300});
    ASSERT_TRUE(large.ok()) << large.message();
    const auto result = finish(changed);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(result->report.film_hash, whole->report.film_hash);
    EXPECT_LE(result->report.peak.memory_bytes, options_.memory_limit);
}

// Of a picture that is ended early, samples that are begun out of turn are counted once they have begun.
TEST_F(Sessions, progress_stays_within_the_job_after_a_stop) {
    std::atomic<bool> stop{false};
    options_.stop = &stop;
    options_.width = 300, options_.height = 200, options_.spp = 100;
    options_.tuning.paths = 512;
    Session stopped = session(options_);
    ASSERT_TRUE(stopped.step(0).ok());
    stop = true;
    while (!stopped.done()) {
        ASSERT_TRUE(stopped.step(0).ok());
        EXPECT_LE(stopped.progress().spp, 100);
        EXPECT_LE(stopped.progress().finished_spp, stopped.progress().spp);
    }
    EXPECT_GT(stopped.progress().spp, 0);
}

TEST_F(Sessions, that_nobody_drives_are_not_said_to_hang) {
    std::atomic<int> warnings{0};
    RenderCallbacks callbacks;
    callbacks.warning = [&warnings](const std::string&) { warnings++; };
    options_.stall_seconds = 2;
    auto created = Session::create(*blocks_, options_, callbacks);
    ASSERT_TRUE(created.ok()) << created.status().message();
    ASSERT_TRUE(created->step(0).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    ASSERT_TRUE(created->step(1e9).ok());
    ASSERT_TRUE(created->done());
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    EXPECT_EQ(warnings, 0);
}

TEST_F(Sessions, tell_of_blocks_and_pixels) {
    options_.layers = *parse_film_layers("depth,material,samples");
    Session looked_at = session(options_);
    EXPECT_EQ(looked_at.blocks().size(), blocks_->count());
    bool waited = false;
    while (!looked_at.done()) {
        ASSERT_TRUE(looked_at.step(0).ok());
        for (const BlockStatus& block : looked_at.blocks())
            waited = waited || (block.waiting_rays > 0 && block.state != BlockStatus::State::resident);
    }
    EXPECT_TRUE(waited);
    const auto at = looked_at.layers_at(20, 25);
    ASSERT_TRUE(at.ok()) << at.status().message();
    const auto blocks = looked_at.blocks();
    double spp = 0;
    const auto picture = looked_at.snapshot(&spp);
    ASSERT_TRUE(picture.ok());
    EXPECT_EQ(spp, 8);
    EXPECT_TRUE(std::ranges::any_of(blocks, [](const BlockStatus& block) { return block.state == BlockStatus::State::resident; }));
    const auto result = looked_at.finish();
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_EQ(picture->values, result->image.values);
    ASSERT_EQ(at->size(), 3u);
    for (size_t i = 0; i < 3; i++) EXPECT_EQ((*at)[i].image.values.at(0), result->layers[i].image.values.at(25 * 48 + 20));
    EXPECT_GT((*at)[1].image.values[0], 0);
}

TEST_F(Sessions, what_cannot_work_is_an_error) {
    options_.device = "no such device";
    EXPECT_FALSE(Session::create(*blocks_, options_).ok());
    options_.device.clear();
    options_.memory_limit = 1;
    const auto small = Session::create(*blocks_, options_);
    ASSERT_FALSE(small.ok());
    EXPECT_NE(small.status().message().find("the smallest that would do"), std::string::npos) << small.status().message();
}

}  // namespace
}  // namespace raypager
