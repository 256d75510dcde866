// The order in which samples are begun.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

TEST(SampleOrder, numbers_every_sample_once) {
    for (const uint32_t together : {1u, 2u, 5u, 16u, 64u})
        for (const uint32_t tile : {1u, 3u, 16u, 100u})
            for (const uint32_t region : {0u, 1u, 100u, 850u}) {
                const rp_sample_order order = make_order(tile, together, 7, 37 * 23, region);
                std::set<uint64_t> numbers;
                for (uint32_t pixel = 0; pixel < 37 * 23; pixel++)
                    for (uint32_t sample = 0; sample < 7; sample++) numbers.insert(sample_number(order, 37, 23, pixel, sample));
                EXPECT_EQ(numbers.size(), 7u * 37 * 23);
                EXPECT_EQ(*numbers.rbegin(), 7u * 37 * 23 - 1) << "groups of " << together << ", tiles of " << tile << ", regions of " << region;
            }
}

TEST(SampleOrder, the_samples_of_a_pixel_follow_each_other_in_a_group) {
    const rp_sample_order order = make_order(4, 4, 10, 64);  // one pass, another one, and eight in two groups
    EXPECT_EQ(sample_number(order, 8, 8, 0, 0), 0u);
    EXPECT_EQ(sample_number(order, 8, 8, 8, 0), 4u) << "the second row of the first tile";
    EXPECT_EQ(sample_number(order, 8, 8, 1, 1), 64u + 1) << "the second stretch has one pass";
    EXPECT_EQ(sample_number(order, 8, 8, 0, 2), 2 * 64u);
    EXPECT_EQ(sample_number(order, 8, 8, 0, 5), 2 * 64u + 3);
    EXPECT_EQ(sample_number(order, 8, 8, 1, 2), 2 * 64u + 4);
    EXPECT_EQ(sample_number(order, 8, 8, 0, 6), 6 * 64u) << "the second group";
    EXPECT_EQ(sample_number(make_order(4, 4, 9, 64), 8, 8, 1, 7), 6 * 64u + 3 + 1) << "seven passes: a group of four and one of three";
    rp_sample_order longer = order;
    longer.grouped_passes = 8;
    EXPECT_EQ(sample_number(longer, 8, 8, 1, 9), 9 * 64u + 1) << "passes behind the groups come one by one";
}

TEST(SampleOrder, regions_get_the_samples_of_a_stretch_one_after_the_other) {
    const rp_sample_order order = make_order(4, 4, 10, 64, 24);  // of 24, 24 and 16 pixels
    EXPECT_EQ(order.region, 24u);
    EXPECT_EQ(sample_number(order, 8, 8, 63, 0), 63u) << "every pixel gets its first sample before any gets another";
    EXPECT_EQ(sample_number(order, 8, 8, 1, 2), 2 * 64u + 4);
    EXPECT_EQ(sample_number(order, 8, 8, 0, 6), 2 * 64u + 4 * 24) << "the second group of the first region";
    EXPECT_EQ(sample_number(order, 8, 8, 20, 2), 2 * 64u + 8 * 24) << "place 24: the second region";
    EXPECT_EQ(sample_number(order, 8, 8, 36, 9), 2 * 64u + 8 * 48 + 4 * 16 + 3) << "place 48: the third, a smaller one";
    EXPECT_EQ(make_order(4, 4, 10, 64, 64).region, 0u) << "the whole picture";
}

TEST(SampleOrder, long_renders_have_regions) {
    const rp_sample_order order = make_order(16, 16, 64, 640 * 360);  // the last stretch has 56 passes
    EXPECT_EQ(default_region(order, 500'000, 640 * 360), 3 * 500'000u / 56 + 1);
    EXPECT_EQ(default_region(order, 1'000'000, 640 * 360), 0u) << "fewer than six";
    EXPECT_EQ(default_region(make_order(16, 16, 4096, 640 * 360), 1'000'000, 640 * 360), 3'000'000u / 3584 + 1);
    EXPECT_EQ(default_region(make_order(16, 16, 1, 100), 1024, 100), 0u);
    for (const uint32_t spp : {1u, 17u, 64u, 1000u, 4096u, 65535u}) {
        const rp_sample_order each = make_order(16, 8, spp, 640 * 360);
        const uint64_t most = max_slots_with_regions(each, 640 * 360);
        EXPECT_GT(default_region(each, most, 640 * 360), 0u) << spp;
        EXPECT_LE(default_region(each, most, 640 * 360) * min_regions, 640u * 360) << spp;
        EXPECT_EQ(default_region(each, most + 1, 640 * 360), 0u) << spp;
    }
}

TEST(SampleOrder, groups_are_no_larger_than_asked_for) {
    EXPECT_EQ(make_order(16, 0, 8, 1000).together, 1u);
    EXPECT_EQ(make_order(16, 1000, 200, 1000).together, 64u);
    EXPECT_EQ(make_order(16, 16, 100, 1000).grouped_passes, 100u);
    EXPECT_EQ(default_together(1920 * 1080), 16u);
    EXPECT_EQ(default_together(uint64_t{1} << 24), 2u);
    EXPECT_EQ(default_together(uint64_t{1} << 31), 1u);
    EXPECT_EQ(make_order(16, 64, 64, uint64_t{1} << 31).together, 1u) << "numbers in a group have 32 bits";
}

// Wherever a render stops, what has begun is even.
TEST(SampleOrder, no_pixel_has_more_than_eight_times_the_samples_of_another) {
    constexpr uint32_t width = 7, height = 5;
    for (const uint32_t spp : {2u, 7u, 16u, 61u, 200u})
        for (const uint32_t together : {1u, 5u, 16u})
            for (const uint32_t region : {0u, 1u, 10u}) {
                const rp_sample_order order = make_order(2, together, spp, width * height, region);
                std::vector<uint32_t> pixel_of(uint64_t{spp} * width * height);
                for (uint32_t pixel = 0; pixel < width * height; pixel++)
                    for (uint32_t sample = 0; sample < spp; sample++) pixel_of[sample_number(order, width, height, pixel, sample)] = pixel;
                std::vector<uint32_t> samples(width * height);
                for (uint64_t begun = 0; begun < pixel_of.size(); begun++) {
                    samples[pixel_of[begun]]++;
                    if (begun + 1 < width * height) continue;
                    const auto [least, most] = std::minmax_element(samples.begin(), samples.end());
                    ASSERT_GE(*least, 1u);
                    ASSERT_LE(*most, 8 * *least) << spp << " samples, groups of " << together << ", regions of " << region << ", after " << begun;
                }
            }
}

TEST(SampleOrder, a_render_goes_on_to_no_fewer_samples_than_its_order_is_made_for) {
    const rp_sample_order plain = {16, 1, 8, 0};
    EXPECT_EQ(fewest_passes(plain, 0, 10), 0u);
    EXPECT_EQ(fewest_passes(plain, 1, 10), 1u);
    EXPECT_EQ(fewest_passes(plain, 20, 10), 2u);
    EXPECT_EQ(fewest_passes(plain, 21, 10), 3u);
    EXPECT_EQ(fewest_passes(plain, UINT64_MAX, 10), UINT64_MAX / 10 + 1) << "what a damaged file says";
    for (const rp_sample_order& order : {rp_sample_order{16, 4, 8, 0}, rp_sample_order{16, 1, 8, 5}}) {
        EXPECT_EQ(fewest_passes(order, 0, 10), 0u);
        EXPECT_EQ(fewest_passes(order, 10, 10), 1u) << "the first pass is the same in all of them";
        EXPECT_EQ(fewest_passes(order, 11, 10), 8u);
        EXPECT_EQ(fewest_passes(order, 80, 10), 8u);
        EXPECT_EQ(fewest_passes(order, 81, 10), 9u);
    }
}

// Whatever number of samples it is to have then, a render that goes on takes those before `begun` for the same ones.
TEST(SampleOrder, goes_on_as_it_began) {
    struct Case {
        uint32_t spp, region, step;
        std::vector<uint32_t> later;
    };
    constexpr uint64_t pixels = 6;
    for (const Case& c : {Case{4, 0, 1, {4, 8, 9, 11, 16}}, Case{8, 0, 1, {8, 9, 11, 16}}, Case{11, 0, 1, {4, 8, 9, 11, 16}},
                          Case{8, 4, 1, {4, 8, 9, 11, 16}}, Case{11, 1, 1, {4, 8, 9, 11, 16}}, Case{1029, 4, 211, {4, 1024, 1027, 1029, 1033, 2100}},
                          Case{1100, 5, 197, {1024, 1096, 1100, 1101, 2100}}}) {
        const rp_sample_order first = make_order(2, 4, c.spp, pixels, c.region);
        std::vector<uint64_t> stops = {1024 * pixels, first.grouped_passes * pixels, c.spp * pixels};
        for (uint64_t begun = 0; begun <= c.spp * pixels; begun += c.step) stops.push_back(begun);
        for (const uint32_t later_spp : c.later)
            for (const uint64_t begun : stops) {
                if (begun > c.spp * pixels || fewest_passes(first, begun, pixels) > later_spp) continue;  // refused
                const rp_sample_order later = continue_order(first, begun, later_spp, pixels);
                EXPECT_TRUE(valid_order(later, pixels));
                std::set<uint64_t> numbers;
                for (uint32_t pixel = 0; pixel < pixels; pixel++)
                    for (uint32_t sample = 0; sample < later_spp; sample++) {
                        const uint64_t number = sample_number(later, 3, 2, pixel, sample);
                        numbers.insert(number);
                        const bool had = sample < c.spp && sample_number(first, 3, 2, pixel, sample) < begun;
                        ASSERT_EQ(number < begun, had)
                            << c.spp << " and " << later_spp << " samples, regions of " << c.region << ", stopped at " << begun;
                    }
                ASSERT_EQ(numbers.size(), later_spp * pixels);
                ASSERT_EQ(*numbers.rbegin(), later_spp * pixels - 1);
            }
    }
}

TEST(SampleOrder, ends_early_with_every_pixel_seen) {
    constexpr uint64_t pixels = 35, all = 11 * pixels;
    const rp_sample_order plain = make_order(2, 1, 11, pixels), grouped = make_order(2, 4, 11, pixels), regions = make_order(2, 1, 11, pixels, 10);
    for (const rp_sample_order& order : {plain, grouped, regions})
        for (const bool whole_passes : {false, true}) {
            EXPECT_EQ(early_limit(order, 0, all, pixels, whole_passes), pixels);
            EXPECT_EQ(early_limit(order, 17, all, pixels, whole_passes), pixels);
            EXPECT_EQ(early_limit(order, 17, 20, pixels, whole_passes), 20u) << "no more than there are";
            EXPECT_EQ(early_limit(order, all, all, pixels, whole_passes), all);
        }
    EXPECT_EQ(early_limit(plain, 3 * pixels + 1, all, pixels, true), 4 * pixels);
    EXPECT_EQ(early_limit(plain, 3 * pixels, all, pixels, true), 3 * pixels);
    EXPECT_EQ(early_limit(plain, 3 * pixels + 1, all, pixels, false), 3 * pixels + 1);
    EXPECT_EQ(early_limit(grouped, 3 * pixels + 1, all, pixels, true), 3 * pixels + 1);
    EXPECT_EQ(early_limit(regions, 3 * pixels + 1, all, pixels, true), 3 * pixels + 1);
}

TEST(SampleOrder, what_is_left_of_the_first_pass_is_seen_coarsely_first) {
    constexpr uint32_t width = 200, height = 130;
    const rp_sample_order order = make_order(16, 1, 4, width * height);
    constexpr uint64_t begun = 5000;
    const auto rest = coarse_samples(order, begun, width, height, UINT64_MAX);
    ASSERT_EQ(rest.size(), width * height - begun) << "each of them, once";
    std::set<uint32_t> seen;
    for (const rp_path_sample& s : rest) {
        EXPECT_EQ(s.sample, 0u);
        EXPECT_GE(sample_number(order, width, height, s.pixel, 0), begun);
        seen.insert(s.pixel);
    }
    EXPECT_EQ(seen.size(), rest.size());
    // A sixteenth of them, at every fourth pixel of every fourth row.
    const auto few = coarse_samples(order, begun, width, height, rest.size() / 16 - 60);
    EXPECT_EQ(few.size(), rest.size() / 16 - 60);
    for (const rp_path_sample& s : few) EXPECT_TRUE(s.pixel % width % 4 == 0 && s.pixel / width % 4 == 0) << s.pixel;
}

TEST(SampleOrder, that_cannot_be_is_told_apart) {
    EXPECT_FALSE(valid_order({0, 1, 1, 0}, 10));
    EXPECT_FALSE(valid_order({2000, 1, 1, 0}, 10));
    EXPECT_FALSE(valid_order({16, 0, 0, 0}, 10));
    EXPECT_FALSE(valid_order({16, 65, 65, 0}, 10));
    EXPECT_FALSE(valid_order({16, 4, 65536, 0}, 10));
    EXPECT_FALSE(valid_order({16, 4, 8, 0}, uint64_t{1} << 31));
    EXPECT_TRUE(valid_order({16, 4, 8, 0}, 10));
}

}  // namespace
}  // namespace raypager
