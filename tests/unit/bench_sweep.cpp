// What sweeps make of their measurements: figures and tables.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "bench/sweep_figures.hpp"

namespace raypager::bench {
namespace {

// Two limits of one policy, two repeats; the second limit takes 1.5 times as long.
SweepResult sample_result() {
    SweepResult result;
    result.geometry_bytes = 1000;
    result.variants = {{{0, 100}, {}, {}, Connection::queue}, {{0, 25}, {}, {}, Connection::queue}};
    result.reference.spp = 64;
    for (uint32_t repeat = 0; repeat < 2; repeat++)
        for (size_t variant = 0; variant < 2; variant++) {
            SweepRun run;
            run.variant = variant;
            run.repeat = repeat;
            run.seconds = (variant ? 3.0 : 2.0) * (1 + repeat);
            run.report.connection = "queue";
            run.report.spp = 4;
            run.report.film_hash = 7;
            run.report.limits.geometry_bytes = variant ? 250 : 1000;
            run.report.rays = {50, 25, 25};
            run.report.paging.bytes_loaded = variant ? 4000 : 1000;
            run.report.paging.evictions = variant ? 3 : 0;
            run.convergence = {{run.seconds / 4, 1, 0.4, 500}, {run.seconds, 4, 0.2, 1000}};
            run.journal = {{1, 0, true}, {2, 0, false}, {2, 1, true}};
            run.round_seconds = {1, 2, 3};
            result.runs.push_back(run);
        }
    return result;
}

size_t count(const std::string& text, const std::string& part) {
    size_t found = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) found++;
    return found;
}

TEST(SweepFigures, medians_and_paired_ratios) {
    EXPECT_EQ(median({3, 1, 2}), 2);
    EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
    const auto figures = variant_figures(sample_result());
    ASSERT_EQ(figures.size(), 2u);
    EXPECT_DOUBLE_EQ(figures[0].slow_down, 1);
    EXPECT_DOUBLE_EQ(figures[1].slow_down, 1.5);
    EXPECT_DOUBLE_EQ(figures[1].seconds, 4.5);
    EXPECT_DOUBLE_EQ(figures[1].bytes_per_ray, 40);
    EXPECT_DOUBLE_EQ(figures[1].resident_percent, 25);
}

TEST(SweepFigures, time_to_an_error_is_interpolated) {
    const std::vector<ConvergencePoint> curve = {{1, 1, 0.8, 0}, {4, 4, 0.4, 0}, {16, 16, 0.2, 0}};  // error as 1 / sqrt(time)
    EXPECT_DOUBLE_EQ(*seconds_to(curve, 0.4), 4);
    EXPECT_NEAR(*seconds_to(curve, 0.8 / std::sqrt(8)), 8, 1e-9);
    EXPECT_EQ(*seconds_to(curve, 1), 1);  // the first point is all that is known
    EXPECT_FALSE(seconds_to(curve, 0.1));
    EXPECT_NEAR(common_rmse(sample_result()), 0.21, 1e-12);
}

TEST(SweepFigures, tables_have_a_row_a_run) {
    const SweepResult result = sample_result();
    std::istringstream lines(runs_csv(result));
    std::string line;
    std::getline(lines, line);
    const size_t columns = count(line, ",");
    EXPECT_TRUE(line.starts_with("limit,policy,paths,connection,repeat,"));
    EXPECT_TRUE(line.ends_with(",film_hash"));
    size_t rows = 0;
    for (; std::getline(lines, line); rows++) EXPECT_EQ(count(line, ","), columns) << line;
    EXPECT_EQ(rows, 4u);
    EXPECT_EQ(count(convergence_csv(result), "\n"), 9u);
    EXPECT_EQ(count(sweep_table(result), "\n"), 3u);
}

TEST(SweepFigures, tables_of_residency_say_who_came_and_left_when) {
    SweepResult result = sample_result();
    result.runs.resize(2);
    result.runs[0].journal.clear();
    EXPECT_EQ(residency_csv(result), "run,round,seconds,block,came\n1,1,1.000000,0,1\n1,2,2.000000,0,0\n1,2,2.000000,1,1\n");
    result.runs[1].round_seconds.clear();  // of a repeat that kept none
    EXPECT_EQ(residency_csv(result), "run,round,seconds,block,came\n");
}

TEST(Sweep, variants_are_every_combination_once) {
    SweepSettings settings;
    settings.limits = {{0, 100}, {0, 10}, {1000, 0}};
    settings.policies = {
        {PolicyKind::lru, {}}, {PolicyKind::most_wanted, SweepPolicy::Baseline::paper}, {PolicyKind::lru, SweepPolicy::Baseline::host}};
    settings.paths = {{}, {0, 4}};
    settings.connections = {Connection::queue, Connection::roulette};
    // lru: 3 limits x 2 paths x 2 connections; paper: 3 limits; host: 2 paths x 2 connections
    const auto variants = sweep_variants(settings);
    EXPECT_EQ(variants.size(), 12u + 3 + 4);
    std::vector<std::string> names;
    for (const SweepVariant& v : variants) names.push_back(v.settings_name() + " at " + v.limit_name());
    std::sort(names.begin(), names.end());
    EXPECT_EQ(std::unique(names.begin(), names.end()), names.end());
    EXPECT_EQ(variants.back().settings_name(), "host, 4x paths, roulette");
}

TEST(Sweep, films_that_differ_are_found) {
    SweepResult result = sample_result();
    EXPECT_TRUE(find_different_films(result.variants, result.runs).empty());
    result.runs[3].report.film_hash = 8;
    const auto different = find_different_films(result.variants, result.runs);
    ASSERT_EQ(different.size(), 1u);
    EXPECT_NE(different[0].find("aged-wants at 25%, repeat 2"), std::string::npos) << different[0];
    // Another number of samples, or another rule of connection, is another picture.
    result.runs[3].report.spp = 5;
    EXPECT_TRUE(find_different_films(result.variants, result.runs).empty());
    result.runs[3].report.spp = 4;
    result.runs[3].report.connection = "roulette";
    EXPECT_TRUE(find_different_films(result.variants, result.runs).empty());
}

TEST(Sweep, estimates_the_time_left_by_variant) {
    SweepSettings settings;
    settings.limits = {{0, 100}, {0, 25}, {0, 3}};
    settings.policies = {{}};
    settings.paths = {{}};
    settings.connections = {Connection::queue};
    settings.repeats = 2;
    EXPECT_EQ(run_count(settings), 6u);
    EXPECT_FALSE(seconds_left(settings, {}).has_value());
    std::vector<SweepRun> done(2);
    done[0].wall_seconds = 10;
    done[1].variant = 1;
    done[1].wall_seconds = 20;
    EXPECT_DOUBLE_EQ(*seconds_left(settings, done), 10 + 20 + 2 * 15);
    for (size_t variant = 0; variant < 3; variant++)
        for (uint32_t repeat = 0; repeat < 2; repeat++) {
            SweepRun run;
            run.variant = variant;
            run.repeat = repeat;
            run.wall_seconds = 1;
            done.push_back(run);
        }
    EXPECT_DOUBLE_EQ(*seconds_left(settings, {done.begin() + 2, done.end()}), 0);
}

}  // namespace
}  // namespace raypager::bench
