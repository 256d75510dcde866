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

TEST(SampleOrder, regions_get_their_samples_one_after_the_other) {
    const rp_sample_order order = make_order(4, 4, 10, 64, 24);  // of 24, 24 and 16 pixels: nine passes, and for all of them one more
    EXPECT_EQ(order.region, 24u);
    EXPECT_EQ(sample_number(order, 8, 8, 1, 0), 3u);
    EXPECT_EQ(sample_number(order, 8, 8, 0, 3), 3 * 24u) << "the second group of the first region";
    EXPECT_EQ(sample_number(order, 8, 8, 20, 0), 9 * 24u) << "place 24: the second region";
    EXPECT_EQ(sample_number(order, 8, 8, 36, 8), 9 * 48u + 6 * 16 + 2) << "place 48: the third, a smaller one";
    EXPECT_EQ(sample_number(order, 8, 8, 1, 9), 9 * 64u + 1) << "a pass of its own";
    // Of many passes, a stretch at a time.
    const rp_sample_order many = make_order(4, 10, 3000, 64, 24);
    EXPECT_EQ(sample_number(many, 8, 8, 0, 1019), 1010 * 24u + 9);
    EXPECT_EQ(sample_number(many, 8, 8, 0, 1020), 1020 * 64u) << "the second stretch";
    EXPECT_EQ(sample_number(many, 8, 8, 20, 2040), 2040 * 64u + 960 * 24) << "the last, which has less passes";
    EXPECT_EQ(make_order(4, 4, 10, 64, 64).region, 0u) << "the whole picture";
}

TEST(SampleOrder, long_renders_have_regions) {
    const rp_sample_order order = make_order(16, 16, 64, 640 * 360);
    EXPECT_EQ(default_region(order, 500'000, 640 * 360), 3 * 500'000u / 64 + 1);
    EXPECT_EQ(default_region(order, 1'000'000, 640 * 360), 0u) << "only five";
    EXPECT_EQ(default_region(make_order(16, 16, 4096, 640 * 360), 1'000'000, 640 * 360), 3'000'000u / 1024 + 1)
        << "of no more passes than are in a stretch";
    EXPECT_EQ(default_region(make_order(16, 16, 1, 100), 1024, 100), 0u);
    for (const uint32_t spp : {1u, 17u, 64u, 1000u, 4096u, 65535u}) {
        const rp_sample_order each = make_order(16, 8, spp, 640 * 360);
        const uint64_t most = most_slots_with_regions(each, 640 * 360);
        EXPECT_GT(default_region(each, most, 640 * 360), 0u) << spp;
        EXPECT_LE(default_region(each, most, 640 * 360) * least_regions, 640u * 360) << spp;
        EXPECT_EQ(default_region(each, most + 1, 640 * 360), 0u) << spp;
    }
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
    const rp_sample_order regions = {16, 4, 1028, 5};  // two stretches
    EXPECT_EQ(passes_begun(regions, 0, 10), 0u);
    EXPECT_EQ(passes_begun(regions, 1, 10), 1024u);
    EXPECT_EQ(passes_begun(regions, 10240, 10), 1024u);
    EXPECT_EQ(passes_begun(regions, 10241, 10), 1028u);
    EXPECT_EQ(passes_begun(regions, 10281, 10), 1029u);
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
                if (begun > c.spp * pixels || passes_begun(first, begun, pixels) > later_spp) continue;  // refused
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

// However a render ends before its time: no sample is taken twice, every pixel has one, and no more are begun than that asks for.
TEST(SampleOrder, ends_early_with_every_pixel_seen) {
    struct Case {
        uint32_t spp, together, region, step;
    };
    constexpr uint64_t pixels = 35;
    for (const Case& c : {Case{11, 1, 0, 1}, Case{11, 2, 0, 1}, Case{11, 4, 0, 1}, Case{11, 16, 0, 1}, Case{11, 1, 10, 1}, Case{11, 4, 10, 1},
                          Case{11, 4, 34, 1}, Case{11, 16, 1, 1}, Case{1100, 16, 10, 487}})
        for (const bool keep_order : {false, true}) {
            const rp_sample_order order = make_order(2, c.together, c.spp, pixels, c.region);
            const uint64_t all = c.spp * pixels;
            // So many passes are begun one pixel or region after the other.
            const uint64_t stretch = c.region ? std::min<uint64_t>(1024 / order.together * order.together, order.grouped_passes) : order.together;
            for (uint64_t begun = 0; begun <= all; begun += c.step) {
                const EarlyEnd end = early_end(order, begun, all, pixels, keep_order);
                ASSERT_TRUE(valid_order(end.order, pixels));
                ASSERT_GE(end.sample_limit, end.next_sample);
                const uint64_t more = end.sample_limit - end.next_sample;
                std::vector<uint32_t> of_pixel(pixels);
                uint64_t taken = 0;
                for (uint32_t pixel = 0; pixel < pixels; pixel++)
                    for (uint32_t sample = 0; sample < c.spp; sample++) {
                        const bool before = sample_number(order, 7, 5, pixel, sample) < begun;
                        const uint64_t number = sample_number(end.order, 7, 5, pixel, sample);
                        const bool after = number >= end.next_sample && number < end.sample_limit;
                        ASSERT_FALSE(before && after) << "twice: groups of " << order.together << ", stopped at " << begun;
                        of_pixel[pixel] += before || after;
                        taken += before || after;
                    }
                ASSERT_EQ(taken, begun + more);
                ASSERT_GE(*std::min_element(of_pixel.begin(), of_pixel.end()), 1u)
                    << "groups of " << order.together << ", regions of " << c.region << ", stopped at " << begun;
                if (keep_order) {
                    ASSERT_EQ(end.order.together, order.together);
                    ASSERT_EQ(end.order.region, order.region);
                    ASSERT_EQ(end.next_sample, begun);
                } else {
                    ASSERT_LE(more, pixels) << "a pass at most";
                }
                if (stretch > 1 && begun >= stretch * pixels && begun < order.grouped_passes * pixels) {
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
