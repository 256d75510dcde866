// Windows of the film: each sample is taken in the one that has its row, once.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "render/film_windows.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

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

}  // namespace
}  // namespace raypager
