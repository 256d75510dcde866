// Windows of the film: each sample is taken in the one that has its row, once.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "render/film_windows.hpp"
#include "render/memory_plan.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

TEST(SampleRanges, in_both_and_without) {
    constexpr uint32_t seed = 3;
    std::mt19937 random(seed);
    for (int trial = 0; trial < 500; trial++) {
        const auto some = [&random] {
            std::vector<SampleRange> ranges;
            for (uint64_t at = random() % 5; at < 60; at += random() % 9) {
                const uint64_t end = at + random() % 8;
                ranges.push_back({at, end});
                at = end;
            }
            return merge_ranges(std::move(ranges));
        };
        const auto has = [](const std::vector<SampleRange>& ranges, uint64_t number) {
            return std::any_of(ranges.begin(), ranges.end(), [number](const SampleRange& r) { return r.begin <= number && number < r.end; });
        };
        const auto a = some(), b = some(), both = ranges_of_both(a, b), rest = ranges_without(a, b);
        ASSERT_EQ(merge_ranges(both).size(), both.size()) << "trial " << trial << " of seed " << seed;
        for (uint64_t number = 0; number < 80; number++) {
            ASSERT_EQ(has(both, number), has(a, number) && has(b, number)) << number << ", trial " << trial << " of seed " << seed;
            ASSERT_EQ(has(rest, number), has(a, number) && !has(b, number)) << number << ", trial " << trial << " of seed " << seed;
        }
    }
}

struct Picture {
    uint32_t width, height, tile, together, spp, region, rows;
    uint32_t more_spp = 0;  // behind those that are grouped, as after a checkpoint
};
const Picture pictures[] = {{37, 23, 4, 16, 17, 100, 8, 5}, {37, 23, 16, 4, 9, 0, 16, 7}, {37, 23, 16, 1, 3, 0, 16},   {37, 23, 16, 16, 17, 0, 16},
                            {5, 9, 2, 4, 10, 0, 4},         {64, 32, 8, 16, 16, 0, 24},   {1, 40, 7, 3, 5, 0, 14},     {37, 23, 4, 16, 17, 100, 8},
                            {5, 6, 2, 4, 300, 14, 2},       {5, 3, 2, 1, 700, 1, 2},      {64, 32, 8, 7, 100, 512, 8}, {16, 16, 100, 9, 20, 50, 16}};

TEST(FilmWindows, have_every_sample_once) {
    for (const Picture& p : pictures) {
        rp_render_params params = {};
        params.width = p.width, params.height = p.height, params.film_rows = p.rows;
        const uint64_t pixels = uint64_t{p.width} * p.height;
        params.order = make_order(p.tile, p.together, p.spp, pixels, p.region);
        const uint32_t spp = p.spp + p.more_spp;
        // Of all numbers some have begun already.
        constexpr uint32_t seed = 11;
        std::mt19937_64 random(seed);
        std::vector<SampleRange> left;
        for (uint64_t at = random() % pixels; at < pixels * spp;) {
            const uint64_t end = std::min<uint64_t>(pixels * spp, at + 1 + random() % (3 * pixels));
            left.push_back({at, end});
            at = end + random() % pixels;
        }
        std::vector<rp_path_sample> again;
        for (uint32_t pixel = 0; pixel < pixels; pixel += 3) again.push_back({pixel, pixel % spp});
        FilmWindows windows(params, left, again);
        std::vector<uint32_t> row_of_number(pixels * spp);
        for (uint32_t pixel = 0; pixel < pixels; pixel++)
            for (uint32_t sample = 0; sample < spp; sample++)
                row_of_number[sample_number(params.order, p.width, p.height, pixel, sample)] = pixel / p.width;
        uint64_t taken = 0, taken_again = 0, all = 0;
        for (const SampleRange& range : left) all += range.size();
        std::set<uint32_t> rows;
        while (windows.any_left()) {
            const FilmWindows::Window window = windows.take();
            EXPECT_TRUE(rows.insert(window.first_row).second);
            const auto is_here = [&](uint32_t row) { return row >= window.first_row && row - window.first_row < p.rows; };
            for (const SampleRange& range : window.ranges)
                for (uint64_t number = range.begin; number < range.end; number++) ASSERT_TRUE(is_here(row_of_number[number])) << number;
            for (const SampleRange& range : window.ranges) taken += range.size();
            for (const rp_path_sample& sample : window.again) ASSERT_TRUE(is_here(sample.pixel / p.width));
            taken_again += window.again.size();
            EXPECT_EQ(windows.numbers_left(), all - taken);
        }
        EXPECT_EQ(taken, all) << p.width << "x" << p.height << ", groups of " << p.together << ", regions of " << p.region;
        EXPECT_EQ(taken_again, again.size());
    }
}

// What is left in windows that are to come may become less.
TEST(FilmWindows, without_what_is_not_to_begin_any_more) {
    rp_render_params params = {};
    params.width = 10, params.height = 30, params.film_rows = 10;
    params.order = make_order(5, 1, 4, 300);
    FilmWindows windows(params, {{0, 1200}}, {});
    EXPECT_EQ(windows.take().first_row, 0u);
    EXPECT_EQ(windows.numbers_left(), 800u);
    windows.replace_left({{200, 250}});  // of the first pass, in the last window
    const FilmWindows::Window last = windows.take();
    EXPECT_EQ(last.first_row, 20u);
    EXPECT_EQ(last.ranges, (std::vector<SampleRange>{{200, 250}}));
    EXPECT_FALSE(windows.any_left());
}

TEST(MemoryPlan, large_films_are_there_in_parts) {
    MemoryNeeds needs;
    needs.limit = 100 << 20;
    needs.fixed = 4 << 20;
    needs.film = 40 << 20;
    needs.per_slot = 100;
    needs.geometry = 30 << 20;
    needs.largest_block = 1 << 20;
    needs.default_slots = 1 << 16;
    needs.total_paths = uint64_t{1} << 40;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 40u << 20);  // what cannot be divided
    needs.film_part = 1 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 40u << 20);  // less than half
    needs.max_film = 30 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 20u << 20);  // two equal parts
    needs.max_film = UINT64_MAX;
    needs.film = 50 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 50u << 20);  // pool and slots take 36.3 MiB, and have no use for more
    needs.geometry = 60 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 25u << 20);  // two parts, of at most the 29.7 MiB that are spare
    needs.geometry = 200 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 17u << 20);  // three, of at most a quarter of 96 MiB
    needs.whole_film = true;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 50u << 20);
    needs.film = 95 << 20;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 24u << 20) << "which does not fit";
    needs.whole_film = false;
    needs.film = 50 << 20;
    needs.requested_slots = 900000;
    EXPECT_EQ(plan_memory(needs)->film_bytes, 9u << 20);  // of 96 MiB, 85.8 are for slots, 1 is for a block
}

// Down to one part and the fewest slots, or those that are asked for.
TEST(MemoryPlan, parts_of_films_are_never_over_the_limit) {
    for (const uint64_t slots : {uint64_t{0}, uint64_t{200000}})
        for (const uint64_t part : {uint64_t{4} << 10, uint64_t{1} << 20}) {
            MemoryNeeds needs;
            needs.fixed = 1 << 20;
            needs.film = uint64_t{8} << 30;
            needs.film_part = part;
            needs.per_slot = 100;
            needs.geometry = 30 << 20;
            needs.largest_block = 1 << 20;
            needs.default_slots = 1 << 16;
            needs.requested_slots = slots;
            needs.total_paths = uint64_t{1} << 40;
            const uint64_t smallest = needs.fixed + part + (slots ? slots : min_slots) * needs.per_slot + needs.largest_block;
            for (uint64_t limit = smallest - 1000; limit < smallest + (200 << 20); limit += limit < smallest + 1000 ? 100 : 777777) {
                needs.limit = limit;
                const auto plan = plan_memory(needs);
                ASSERT_EQ(plan.ok(), limit >= smallest) << limit;
                if (!plan.ok()) {
                    EXPECT_NE(plan.status().message().find(std::to_string(smallest)), std::string::npos) << plan.status().message();
                    continue;
                }
                EXPECT_LE(needs.fixed + plan->film_bytes + plan->slots * needs.per_slot + plan->pool_bytes, limit);
                EXPECT_EQ(plan->film_bytes % part, 0u);
            }
        }
}

}  // namespace
}  // namespace raypager
