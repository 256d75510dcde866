// The public library: sessions that are driven from outside end in the picture of a render from start to end.
#include <gtest/gtest.h>

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
