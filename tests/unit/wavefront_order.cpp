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
        for (const uint32_t tile : {1u, 3u, 16u, 100u}) {
            const rp_sample_order order = make_order(tile, together, 7, 37 * 23);
            std::set<uint64_t> numbers;
            for (uint32_t pixel = 0; pixel < 37 * 23; pixel++)
                for (uint32_t sample = 0; sample < 7; sample++) numbers.insert(sample_number(order, 37, 23, pixel, sample));
            EXPECT_EQ(numbers.size(), 7u * 37 * 23);
            EXPECT_EQ(*numbers.rbegin(), 7u * 37 * 23 - 1) << "groups of " << together << ", tiles of " << tile;
        }
}

TEST(SampleOrder, the_samples_of_a_pixel_follow_each_other_in_a_group) {
    const rp_sample_order order = make_order(4, 4, 10, 64);  // three groups of three passes, and one pass
    EXPECT_EQ(order.together, 3u);
    EXPECT_EQ(order.grouped_passes, 9u);
    EXPECT_EQ(sample_number(order, 8, 8, 0, 0), 0u);
    EXPECT_EQ(sample_number(order, 8, 8, 0, 2), 2u);
    EXPECT_EQ(sample_number(order, 8, 8, 1, 0), 3u);
    EXPECT_EQ(sample_number(order, 8, 8, 8, 0), 4 * 3u) << "the second row of the first tile";
    EXPECT_EQ(sample_number(order, 8, 8, 0, 3), 3 * 64u) << "the second group";
    EXPECT_EQ(sample_number(order, 8, 8, 1, 9), 9 * 64u + 1) << "a pass of its own";
}

TEST(SampleOrder, groups_are_of_equal_size) {
    struct Case {
        uint32_t spp, together, each, grouped;
    };
    for (const Case& c : {Case{1, 16, 1, 1}, Case{15, 16, 15, 15}, Case{16, 16, 16, 16}, Case{17, 16, 8, 16}, Case{20, 16, 10, 20},
                          Case{64, 16, 16, 64}, Case{100, 16, 14, 98}, Case{100, 1, 1, 100}, Case{8, 0, 1, 8}, Case{200, 1000, 50, 200}}) {
        const rp_sample_order order = make_order(16, c.together, c.spp, 1000);
        EXPECT_EQ(order.together, c.each) << c.spp;
        EXPECT_EQ(order.grouped_passes, c.grouped) << c.spp;
        EXPECT_TRUE(valid_order(order, 1000));
    }
    EXPECT_EQ(default_together(1920 * 1080), 16u);
    EXPECT_EQ(default_together(uint64_t{1} << 24), 2u);
    EXPECT_EQ(default_together(uint64_t{1} << 31), 1u);
    EXPECT_EQ(make_order(16, 64, 64, uint64_t{1} << 31).together, 1u) << "numbers in a group have 32 bits";
}

TEST(SampleOrder, passes_of_a_group_begin_together) {
    const rp_sample_order order = {16, 4, 8, 0};  // then one by one
    EXPECT_EQ(passes_begun(order, 0, 10), 0u);
    EXPECT_EQ(passes_begun(order, 1, 10), 4u);
    EXPECT_EQ(passes_begun(order, 40, 10), 4u);
    EXPECT_EQ(passes_begun(order, 41, 10), 8u);
    EXPECT_EQ(passes_begun(order, 80, 10), 8u);
    EXPECT_EQ(passes_begun(order, 81, 10), 9u);
    EXPECT_EQ(passes_begun(order, 90, 10), 9u);
    EXPECT_EQ(passes_begun(order, UINT64_MAX, 10), UINT64_MAX / 10 + 1) << "what a damaged file says";
}

// Whatever number of samples it is to have then, a render that goes on takes those before `begun` for the same ones.
TEST(SampleOrder, goes_on_as_it_began) {
    constexpr uint64_t pixels = 6;
    for (const uint32_t spp : {4u, 8u, 11u})
        for (const uint32_t later_spp : {4u, 8u, 9u, 11u, 16u}) {
            const rp_sample_order first = make_order(2, 4, spp, pixels);
            for (uint64_t begun = 0; begun <= spp * pixels; begun++) {
                if (passes_begun(first, begun, pixels) > later_spp) continue;  // refused
                const rp_sample_order later = continue_order(first, begun, later_spp, pixels);
                EXPECT_TRUE(valid_order(later, pixels));
                std::set<uint64_t> numbers;
                for (uint32_t pixel = 0; pixel < pixels; pixel++)
                    for (uint32_t sample = 0; sample < later_spp; sample++) {
                        const uint64_t number = sample_number(later, 3, 2, pixel, sample);
                        numbers.insert(number);
                        const bool had = sample < spp && sample_number(first, 3, 2, pixel, sample) < begun;
                        ASSERT_EQ(number < begun, had) << spp << " and " << later_spp << " samples, stopped at " << begun;
                    }
                ASSERT_EQ(numbers.size(), later_spp * pixels);
                ASSERT_EQ(*numbers.rbegin(), later_spp * pixels - 1);
            }
        }
}

// However a render ends before its time: no sample is taken twice, every pixel has one, and no more are begun than that asks for.
TEST(SampleOrder, ends_early_with_every_pixel_seen) {
    constexpr uint64_t pixels = 35;
    constexpr uint32_t spp = 11;
    for (const uint32_t together : {1u, 2u, 4u, 16u})
        for (const bool keep_order : {false, true}) {
            const rp_sample_order order = make_order(2, together, spp, pixels);
            for (uint64_t begun = 0; begun <= spp * pixels; begun++) {
                const EarlyEnd end = early_end(order, begun, spp * pixels, pixels, keep_order);
                ASSERT_TRUE(valid_order(end.order, pixels));
                ASSERT_GE(end.sample_limit, end.next_sample);
                const uint64_t more = end.sample_limit - end.next_sample;
                std::vector<uint32_t> of_pixel(pixels);
                uint64_t taken = 0;
                for (uint32_t pixel = 0; pixel < pixels; pixel++)
                    for (uint32_t sample = 0; sample < spp; sample++) {
                        const bool before = sample_number(order, 7, 5, pixel, sample) < begun;
                        const uint64_t number = sample_number(end.order, 7, 5, pixel, sample);
                        const bool after = number >= end.next_sample && number < end.sample_limit;
                        ASSERT_FALSE(before && after) << "twice: groups of " << order.together << ", stopped at " << begun;
                        of_pixel[pixel] += before || after;
                        taken += before || after;
                    }
                ASSERT_EQ(taken, begun + more);
                ASSERT_GE(*std::min_element(of_pixel.begin(), of_pixel.end()), 1u) << "groups of " << order.together << ", stopped at " << begun;
                if (keep_order) {
                    ASSERT_EQ(end.order.together, order.together);
                    ASSERT_EQ(end.next_sample, begun);
                } else {
                    ASSERT_LE(more, pixels) << "a pass at most";
                }
                if (order.together > 1 && begun >= order.together * pixels && begun < order.grouped_passes * pixels) {
                    ASSERT_EQ(more, 0u);
                }
            }
        }
}

TEST(SampleOrder, that_cannot_be_is_told_apart) {
    EXPECT_FALSE(valid_order({0, 1, 1, 0}, 10));
    EXPECT_FALSE(valid_order({2000, 1, 1, 0}, 10));
    EXPECT_FALSE(valid_order({16, 0, 0, 0}, 10));
    EXPECT_FALSE(valid_order({16, 65, 65, 0}, 10));
    EXPECT_FALSE(valid_order({16, 4, 6, 0}, 10));
    EXPECT_FALSE(valid_order({16, 4, 8, 0}, uint64_t{1} << 31));
    EXPECT_TRUE(valid_order({16, 4, 8, 0}, 10));
}

}  // namespace
}  // namespace raypager
