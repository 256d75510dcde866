// The floats beside a float, against the standard library's.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "base/next_float.hpp"

namespace raypager {
namespace {

TEST(NextFloat, IsThatOfTheStandardLibrary) {
    using Limits = std::numeric_limits<float>;
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    const auto check = [](float x) {
        const auto bits = [](float y) { return std::bit_cast<uint32_t>(y); };
        EXPECT_EQ(bits(next_below(x)), bits(std::nextafter(x, -Limits::infinity()))) << x;
        EXPECT_EQ(bits(next_above(x)), bits(std::nextafter(x, Limits::infinity()))) << x;
    };
    for (const float x : {0.0f, 1.0f, Limits::min(), Limits::denorm_min(), Limits::max(), Limits::infinity()}) {
        check(x);
        check(-x);
    }
    for (int i = 0; i < 100'000; i++)
        if (const auto x = std::bit_cast<float>(static_cast<uint32_t>(random())); !std::isnan(x)) check(x);
    EXPECT_TRUE(std::isnan(next_below(Limits::quiet_NaN())));
    EXPECT_TRUE(std::isnan(next_above(Limits::quiet_NaN())));
}

}  // namespace
}  // namespace raypager
