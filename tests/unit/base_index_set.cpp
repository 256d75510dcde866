// Sets of numbers below a limit, against std::set.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "base/index_set.hpp"

namespace raypager {
namespace {

std::vector<uint32_t> in(const IndexSet& set) {
    std::vector<uint32_t> all;
    set.for_each([&](uint32_t i) { all.push_back(i); });
    return all;
}

TEST(IndexSet, holds_what_a_set_holds) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    for (const uint32_t limit : {1u, 63u, 64u, 65u, 4096u, 4097u, 300'000u}) {
        IndexSet set(limit);
        std::set<uint32_t> expected;
        for (uint32_t step = 0; step < 3000; step++) {
            const auto i = static_cast<uint32_t>(random() % limit);
            const bool goes = random() % 2 == 0;
            set.set(i, !goes);
            goes ? (void)expected.erase(i) : (void)expected.insert(i);
            ASSERT_EQ(set.size(), expected.size());
            ASSERT_EQ(set.contains(i), !goes);
            if (step % 100 == 0) {
                ASSERT_EQ(in(set), std::vector<uint32_t>(expected.begin(), expected.end())) << limit;
            }
        }
        // Who is visited may go.
        std::vector<uint32_t> visited;
        set.for_each([&](uint32_t i) {
            visited.push_back(i);
            if (i % 3 != 0) set.erase(i);
        });
        EXPECT_EQ(visited, std::vector<uint32_t>(expected.begin(), expected.end()));
        std::erase_if(expected, [](uint32_t i) { return i % 3 != 0; });
        EXPECT_EQ(in(set), std::vector<uint32_t>(expected.begin(), expected.end()));
        set.clear();
        EXPECT_TRUE(set.empty() && in(set).empty());
    }
    EXPECT_TRUE(in(IndexSet()).empty() && in(IndexSet(0)).empty());
}

}  // namespace
}  // namespace raypager
