// A sweep that goes on: what it had, and what it refuses.
#include <gtest/gtest.h>

#include <fstream>

#include "cli/sweep_state.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

class SweepStates : public testing::Test {
protected:
    SweepStates() {
        settings_.limits = {{0, 100}, {0, 25}};
        settings_.policies = {{}};
        settings_.paths = {{}};
        settings_.connections = {Connection::queue};
        settings_.repeats = 2;
        settings_.base.spp = 16;
        settings_.base.width = settings_.base.height = 8;
    }

    static bench::SweepRun sample_run(size_t variant, uint32_t repeat) {
        bench::SweepRun run;
        run.variant = variant;
        run.repeat = repeat;
        run.seconds = 1.0 / 3;
        run.wall_seconds = 0.5;
        run.report.device = {"device", "platform", "driver", "CPU"};
        run.report.limits = {1000, 250, 3000};
        run.report.spp = 16;
        run.report.connection = "queue";
        run.report.form = BlockForm::wide;
        run.report.film_hash = 0xfedcba9876543210;
        run.report.seconds.stall = 0.25;
        run.report.rays = {50, 25, 20};
        run.report.paging = {4, 3, 4000, 7, 1};
        run.convergence = {{0.1, 1, 0.4, 500}, {1.0 / 3, 16, 0.1, 4000}};
        run.journal = {{1, 0, true}, {2, 0, false}};
        run.round_seconds = {0.1f, 0.2f};
        return run;
    }

    Result<SweepState> open(bool resume) const { return SweepState::open(folder_.path(), settings_, scene_, resume); }

    void make_one_run() const {
        auto state = open(false);
        ASSERT_TRUE(state.ok()) << state.status().message();
        ASSERT_TRUE(state->add(sample_run(1, 0), bench::sweep_variants(settings_)[1]).ok());
    }

    support::TemporaryFolder folder_;
    bench::SweepSettings settings_;
    BakedScene scene_;
};

TEST_F(SweepStates, give_back_what_was_kept) {
    make_one_run();
    std::ofstream(folder_.path() / "sweep.runs", std::ios::app) << "{\"variant\": \"half a li";  // killed while it was written
    for (int time = 0; time < 2; time++) {
        const auto state = open(true);
        ASSERT_TRUE(state.ok()) << state.status().message();
        ASSERT_EQ(state->earlier().size(), 1u);
        const bench::SweepRun& run = state->earlier().front();
        const bench::SweepRun before = sample_run(1, 0);
        EXPECT_EQ(run.variant, 1u);
        EXPECT_EQ(run.seconds, before.seconds);
        EXPECT_EQ(run.report.film_hash, before.report.film_hash);
        EXPECT_EQ(run.report.form, BlockForm::wide);
        EXPECT_EQ(run.report.rays.total(), 95u);
        EXPECT_EQ(run.report.paging.requests_without_hit, 1u);
        EXPECT_EQ(run.report.device.type, "CPU");
        ASSERT_EQ(run.convergence.size(), 2u);
        EXPECT_EQ(run.convergence[1].rmse, 0.1);
        ASSERT_EQ(run.journal.size(), 2u);
        EXPECT_FALSE(run.journal[1].came);
        EXPECT_EQ(run.round_seconds, before.round_seconds);
    }
}

TEST_F(SweepStates, may_have_other_variants_and_repeats) {
    make_one_run();
    settings_.limits = {{0, 50}, {0, 3}, {0, 25}};
    settings_.repeats = 5;
    const auto more = open(true);
    ASSERT_TRUE(more.ok()) << more.status().message();
    ASSERT_EQ(more->earlier().size(), 1u);
    EXPECT_EQ(more->earlier().front().variant, 2u);
    settings_.limits = {{0, 50}};
    const auto others = open(true);
    ASSERT_TRUE(others.ok());
    EXPECT_TRUE(others->earlier().empty());
    settings_.limits = {{0, 25}};
    EXPECT_EQ(open(true)->earlier().size(), 1u) << "kept although another sweep in between had no use for it";
}

TEST_F(SweepStates, are_refused_where_they_do_not_fit) {
    make_one_run();
    settings_.base.spp = 17;
    const auto refused = open(true);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.status().kind(), ErrorKind::usage);
    EXPECT_NE(refused.status().message().find("--spp 16, not 17"), std::string::npos) << refused.status().message();
    settings_.base.spp = 16;
    scene_.fingerprint = 1;
    scene_.width = 99;
    EXPECT_EQ(open(true).ok(), BakedScene().identity() == scene_.identity());
    scene_ = {};
    auto state = open(true);
    ASSERT_TRUE(state.ok());
    bench::SweepRun other = sample_run(0, 0);
    other.report.device.name = "another device";
    EXPECT_FALSE(state->add(other, bench::sweep_variants(settings_)[0]).ok());
}

TEST_F(SweepStates, are_not_overwritten_unless_they_are_finished) {
    make_one_run();
    const auto refused = open(false);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.status().message().find("holds 1 run of a sweep"), std::string::npos) << refused.status().message();
    EXPECT_NE(refused.status().message().find("--resume"), std::string::npos);
    {
        auto state = open(true);
        ASSERT_TRUE(state.ok());
        ASSERT_TRUE(state->finish().ok());
    }
    EXPECT_EQ(open(true)->earlier().size(), 1u) << "more repeats can be added";
    {
        auto state = open(true);
        ASSERT_TRUE(state->finish().ok());
    }
    const auto anew = open(false);
    ASSERT_TRUE(anew.ok()) << anew.status().message();
    EXPECT_TRUE(anew->earlier().empty());
}

}  // namespace
}  // namespace raypager
