#include <gtest/gtest.h>

#include <random>

#include "residency/residency.hpp"
#include "residency/slab_allocator.hpp"

namespace raypager {
namespace {

TEST(SlabAllocator, takes_the_smallest_extent_that_fits) {
    SlabAllocator pool({1000, 256});  // 1000 is rounded down to 960
    EXPECT_EQ(pool.capacity(), 960u + 256u);
    EXPECT_EQ(*pool.allocate(200), (PoolAddress{1, 0}));
    EXPECT_EQ(*pool.allocate(300), (PoolAddress{0, 0}));
    EXPECT_EQ(pool.free_bytes(), 960u - 320u);
    EXPECT_FALSE(pool.allocate(641).has_value());
    EXPECT_TRUE(pool.fits(640));
}

TEST(SlabAllocator, merges_neighbours_when_they_are_released) {
    SlabAllocator pool({64 * 3});
    const PoolAddress a = *pool.allocate(64), b = *pool.allocate(64), c = *pool.allocate(64);
    pool.release(a, 64);
    pool.release(c, 64);
    EXPECT_FALSE(pool.fits(128));
    pool.release(b, 64);
    EXPECT_TRUE(pool.fits(192));
}

TEST(SlabAllocator, releases_are_taken_back) {
    SlabAllocator pool({64 * 5});
    std::vector<PoolAddress> places;
    for (int i = 0; i < 4; i++) places.push_back(*pool.allocate(64));
    for (const int i : {1, 2, 0}) pool.release(places[i], 64);
    EXPECT_TRUE(pool.fits(192));
    for (const int i : {0, 2, 1}) {
        EXPECT_EQ(pool.free_bytes(), 64u * (i == 0 ? 4 : i == 2 ? 3 : 2));
        pool.take_back(places[i], 64);
    }
    EXPECT_EQ(pool.free_bytes(), 64u);
    EXPECT_EQ(*pool.allocate(64), (PoolAddress{0, 64 * 4}));
    EXPECT_FALSE(pool.fits(64));
}

// Against a plain model: a map of bytes.
TEST(SlabAllocator, agrees_with_a_map_of_units) {
    const uint64_t seed = 7;
    std::mt19937_64 random(seed);
    SlabAllocator pool({64 * 50, 64 * 20});
    std::vector<std::vector<bool>> used = {std::vector<bool>(50), std::vector<bool>(20)};
    std::vector<std::pair<PoolAddress, uint64_t>> live;
    for (int step = 0; step < 20000; step++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", step " << step);
        if (random() % 2 && !live.empty()) {
            const size_t i = random() % live.size();
            const auto [place, bytes] = live[i];
            std::vector<bool>& slab = used[place.slab];
            const uint64_t first = place.offset / 64, units = (bytes + 63) / 64;
            for (uint64_t u = 0; u < units; u++) slab[first + u] = false;
            uint64_t begin = first, end = first + units;
            while (begin > 0 && !slab[begin - 1]) begin--;
            while (end < slab.size() && !slab[end]) end++;
            ASSERT_EQ(pool.release(place, bytes), 64 * (end - begin));
            if (random() % 3 == 0) {
                pool.take_back(place, bytes);
                ASSERT_EQ(pool.release(place, bytes), 64 * (end - begin));
            }
            live.erase(live.begin() + static_cast<std::ptrdiff_t>(i));
            continue;
        }
        const uint64_t bytes = 1 + random() % 900, units = (bytes + 63) / 64;
        bool possible = false;
        for (const auto& slab : used)
            for (size_t run = 0, i = 0; i < slab.size(); i++) possible |= (run = slab[i] ? 0 : run + 1) >= units;
        const auto place = pool.allocate(bytes);
        ASSERT_EQ(place.has_value(), possible);
        if (!place) continue;
        for (uint64_t u = 0; u < units; u++) {
            ASSERT_FALSE(used[place->slab][place->offset / 64 + u]);
            used[place->slab][place->offset / 64 + u] = true;
        }
        live.emplace_back(*place, bytes);
    }
}

TEST(SplitPool, uses_as_few_slabs_as_the_device_allows) {
    EXPECT_EQ(*split_pool(1 << 20, 1 << 30, 1000), (std::vector<uint64_t>{1 << 20}));
    EXPECT_EQ(*split_pool(2500 * 64, 1000 * 64, 1000), (std::vector<uint64_t>{64000, 64000, 32000}));
    EXPECT_FALSE(split_pool(1 << 20, 1000, 1001).ok());
    // In a pool for all there is room for all, whatever the slabs leave over.
    for (const uint64_t slab : {uint64_t{64000}, uint64_t{100000}, uint64_t{1} << 20})
        for (uint64_t count = 1; count < 40; count++) {
            constexpr uint64_t block = 9984;
            const auto sizes = split_pool(pool_for_all(count * block, slab, block), slab, block);
            ASSERT_TRUE(sizes.ok());
            uint64_t places = 0;
            for (const uint64_t size : *sizes) places += size / block;
            EXPECT_GE(places, count) << slab;
        }
    EXPECT_EQ(largest_pool(64000), 64000u * RP_MAX_SLABS);
}

}  // namespace
}  // namespace raypager
