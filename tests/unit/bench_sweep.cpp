// What sweeps make of their measurements: figures, tables, plots.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "bench/residency_raster.hpp"
#include "bench/svg_plot.hpp"
#include "bench/sweep_figures.hpp"
#include "bench/sweep_page.hpp"

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

TEST(Sweep, the_page_stands_alone_and_says_what_was_found) {
    SweepResult result = sample_result();
    SweepPageFacts facts{"a<b>.rpb", "raypager bench sweep \"a&b\"", "today", "1 triangle", 2};
    const std::string page = sweep_page(result, facts);
    EXPECT_EQ(page.find("a<b>"), std::string::npos) << "markup in names";
    EXPECT_NE(page.find("a&lt;b&gt;.rpb"), std::string::npos);
    EXPECT_NE(page.find("a&amp;b"), std::string::npos);
    for (const char* foreign : {"http:", "https:", "<script", "src=", "@import", "url("}) EXPECT_EQ(page.find(foreign), std::string::npos) << foreign;
    EXPECT_EQ(count(page, "<svg"), count(page, "</svg>"));
    EXPECT_EQ(count(page, "<svg"), 1u + 3 + 1);  // convergence, against the limit, one timeline
    EXPECT_NE(page.find("bit for bit"), std::string::npos);
    EXPECT_EQ(page.find("nan"), std::string::npos);
    result.different_films = {"one differs"};
    EXPECT_NE(sweep_page(result, facts).find("worth nothing"), std::string::npos);
}

TEST(SvgPlot, ticks_span_the_values) {
    for (const auto& [low, high] : {std::pair(0.013, 7.0), {1.0, 1.0}, {3e-9, 4e5}, {2.0, 2.1}, {99.0, 101.0}}) {
        for (const AxisTicks& ticks : {log_ticks(low, high), linear_ticks(low, high)}) {
            ASSERT_FALSE(ticks.values.empty());
            EXPECT_LE(ticks.values.front(), low * (1 + 1e-12));
            EXPECT_GE(ticks.values.back(), high * (1 - 1e-12)) << low << " " << high;
            EXPECT_LE(ticks.values.size(), 20u) << low << " " << high;
            EXPECT_TRUE(std::is_sorted(ticks.values.begin(), ticks.values.end()));
        }
    }
}

TEST(SvgPlot, leaves_out_what_a_logarithm_cannot_show) {
    Plot plot;
    plot.log_y = true;
    plot.series = {{"zero", {{1, 0}, {2, 0}}, 0, true, {}}};
    EXPECT_NE(svg_plot(plot).find("no data"), std::string::npos);
    plot.series = {{"some", {{1, 0}, {2, 5}, {3, 9}}, 0, true, {}}};
    const std::string svg = svg_plot(plot);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
    EXPECT_EQ(count(svg, "<circle"), 3u);  // two points and the legend
}

TEST(ResidencyRaster, shows_who_was_there_when) {
    // Four rounds of a second each. Block 0 is there from the end of round 1 to that of round 3, block 2 from round 2 on.
    const std::vector<PagingEvent> journal = {{1, 0, true}, {2, 2, true}, {3, 0, false}};
    const ResidencyRaster raster = rasterise_residency(journal, {1, 2, 3, 4}, 3, 4, 10);
    ASSERT_EQ(raster.columns, 4u);
    ASSERT_EQ(raster.rows, 3u);
    const uint8_t f = ResidencyRaster::full;
    EXPECT_EQ(raster.shades, (std::vector<uint8_t>{0, f, f, 0, 0, 0, 0, 0, 0, 0, f, f}));
    // Rows for two blocks each: half of the first two, the third alone.
    EXPECT_EQ(rasterise_residency(journal, {1, 2, 3, 4}, 3, 4, 2).shades, (std::vector<uint8_t>{0, f / 2, f / 2, 0, 0, 0, f, f}));
    EXPECT_TRUE(rasterise_residency({}, {}, 3).shades.empty());
    EXPECT_NE(svg_residency(raster).find("M1 0h2v1h-2z"), std::string::npos);  // one rectangle for both columns
    EXPECT_NE(svg_residency({}).find("no data"), std::string::npos);
}

TEST(ResidencyRaster, thousands_of_blocks_stay_small) {
    std::vector<PagingEvent> journal;
    std::vector<float> seconds;
    for (uint32_t round = 1; round <= 20000; round++) {
        seconds.push_back(0.001f * static_cast<float>(round));
        journal.push_back({round, round * 7 % 4000, true});
        if (round > 900) journal.push_back({round, (round - 900) * 7 % 4000, false});
    }
    const std::string svg = svg_residency(rasterise_residency(journal, seconds, 4000));
    EXPECT_LT(svg.size(), 700u << 10);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
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
