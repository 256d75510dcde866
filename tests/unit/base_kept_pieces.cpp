// Items that threads make piece by piece, and of which some are left out.
#include <gtest/gtest.h>

#include <random>

#include "base/kept_pieces.hpp"

namespace raypager {
namespace {

TEST(KeptPieces, AreAppendedInOrderWithoutGaps) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    for (const uint32_t one_in : {1u, 2u, 50u, 100'000u}) {
        for (const size_t count : {0u, 1u, 7u, 1000u, 5003u}) {
            std::vector<bool> kept(count);
            for (size_t i = 0; i < count; i++) kept[i] = random() % one_in == 0;
            UnwrittenVector<uint32_t> items;
            std::vector<uint32_t> expected;
            for (uint32_t round = 0; round < 3; round++) {
                const auto number = [&](size_t i) { return static_cast<uint32_t>(round * count + i); };
                append_kept(items, count, 64, [&](size_t begin, size_t end, uint32_t* place) {
                    size_t made = 0;
                    for (size_t i = begin; i < end; i++)
                        if (kept[i]) place[made++] = number(i);
                    return made;
                });
                for (size_t i = 0; i < count; i++)
                    if (kept[i]) expected.push_back(number(i));
            }
            EXPECT_EQ(std::vector<uint32_t>(items.begin(), items.end()), expected) << "one in " << one_in << " of " << count;
        }
    }
}

}  // namespace
}  // namespace raypager
