// Which samples a device begins, and how they are shared out.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "render/sample_pool.hpp"
#include "wavefront/sample_numbers.hpp"

namespace raypager {
namespace {

uint64_t kernel_number(const rp_sample_numbers& numbers, uint64_t count) {
    return count + (count < numbers.first_end ? numbers.first_shift : numbers.then_shift);
}

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

TEST(SampleNumbers, are_those_of_a_list) {
    constexpr uint32_t seed = 7;
    std::mt19937 random(seed);
    for (int trial = 0; trial < 200; trial++) {
        SampleNumbers numbers;
        std::vector<uint64_t> list;
        for (int i = 0; i < 6; i++) {
            const uint64_t begin = random() % 5 ? 100 * i + random() % 50 : (list.empty() ? 3 : list.back() + 1), end = begin + random() % 40;
            numbers.append({begin, end});
            for (uint64_t n = begin; n < end; n++) list.push_back(n);
            if (random() % 3 == 0) {
                const uint64_t count = random() % (list.size() + 1);
                numbers.cut(count);
                list.resize(count);
            }
        }
        ASSERT_EQ(numbers.count(), list.size()) << "seed " << seed;
        for (uint64_t count = 0; count <= list.size(); count++) {
            std::vector<uint64_t> rest;
            for (const SampleRange& range : numbers.from(count))
                for (uint64_t n = range.begin; n < range.end; n++) rest.push_back(n);
            ASSERT_EQ(rest, std::vector<uint64_t>(list.begin() + static_cast<std::ptrdiff_t>(count), list.end()));
            const rp_sample_numbers of_round = numbers.for_round(count);
            ASSERT_LE(of_round.end, list.size());
            ASSERT_TRUE(count == list.size() || of_round.end > count);
            for (uint64_t c = count; c < of_round.end; c++) {
                ASSERT_EQ(kernel_number(of_round, c), list[c]);
            }
        }
    }
}

TEST(SamplePool, gives_each_sample_to_one) {
    SamplePool pool(3);
    pool.add({{10, 20}, {1000, 50000000}});
    pool.add({{20, 30}});
    EXPECT_EQ(pool.left(), 49999020u);
    std::vector<SampleRange> taken;
    uint64_t largest = 0;
    bool failed = false;
    while (const auto range = pool.take()) {
        taken.push_back(*range);
        largest = std::max(largest, range->size());
        if (taken.size() == 20 && !failed) {  // one fails, and its share comes back
            failed = true;
            pool.add({taken.back()});
            taken.pop_back();
        }
    }
    EXPECT_LT(largest, 50000000u / 10);
    EXPECT_LE(taken.back().size(), 65536u);  // the last ones are small
    EXPECT_EQ(merge_ranges(taken), (std::vector<SampleRange>{{10, 30}, {1000, 50000000}}));
    EXPECT_EQ(pool.left(), 0u);
}

TEST(SamplePool, of_one_device_gives_ranges_as_a_whole) {
    SamplePool pool(1);
    pool.add({{5, 1000000000}});
    EXPECT_EQ(pool.take(), (SampleRange{5, 1000000000}));
    EXPECT_FALSE(pool.take());
}

TEST(SamplePool, ends_before_a_number) {
    SamplePool pool(1);
    pool.add({{0, 10}, {20, 30}, {40, 50}});
    pool.cut(25);
    EXPECT_EQ(pool.ranges(), (std::vector<SampleRange>{{0, 10}, {20, 25}}));
    pool.cut(0);
    EXPECT_EQ(pool.left(), 0u);
}

// Slots of devices sleep when it does not.
TEST(SamplePool, expects_more_while_any_are_left) {
    SamplePool pool(2);
    EXPECT_FALSE(pool.expects_more());
    pool.add({{0, 1}});
    EXPECT_TRUE(pool.expects_more());
    ASSERT_TRUE(pool.take());
    EXPECT_FALSE(pool.expects_more());
    pool.add_again({{1, 2}});
    EXPECT_TRUE(pool.expects_more());
    EXPECT_EQ(pool.take_again().size(), 1u);
    EXPECT_FALSE(pool.expects_more());
    pool.expect_more(true);
    EXPECT_TRUE(pool.expects_more());
}

TEST(SamplePool, shares_out_what_is_begun_again) {
    SamplePool pool(2);
    std::vector<rp_path_sample> samples;
    for (uint32_t i = 0; i < 101; i++) samples.push_back({i, 0});
    pool.add_again(samples);
    std::set<uint32_t> pixels;
    size_t times = 0;
    for (auto taken = pool.take_again(); !taken.empty(); taken = pool.take_again(), times++) {
        EXPECT_LE(taken.size(), 51u);
        for (const rp_path_sample& sample : taken) EXPECT_TRUE(pixels.insert(sample.pixel).second);
    }
    EXPECT_EQ(pixels.size(), 101u);
    EXPECT_EQ(times, 2u);
}

}  // namespace
}  // namespace raypager
