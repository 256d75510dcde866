// Halves, all of them, and floats between them.
#include <gtest/gtest.h>

#include <cmath>

#include "base/half.hpp"

namespace raypager {
namespace {

double half_by_definition(uint16_t half) {
    const int exponent = half >> 10 & 31, mantissa = half & 1023;
    const double magnitude = exponent ? std::ldexp(1024 + mantissa, exponent - 25) : std::ldexp(mantissa, -24);
    return half & 0x8000 ? -magnitude : magnitude;
}

TEST(Half, ComesBackAndRoundsToTheNearest) {
    for (uint32_t bits = 0; bits < 65536; bits++) {
        const auto half = static_cast<uint16_t>(bits);
        if (!is_finite_half(half)) {
            EXPECT_TRUE(is_finite_half(finite_half(half)));
            EXPECT_EQ(is_nan_half(half), (half & 1023) != 0);
            continue;
        }
        const float value = float_of_half(half);
        ASSERT_EQ(value, half_by_definition(half));
        ASSERT_EQ(half_of(value), half);
        ASSERT_EQ(finite_half(half), half);
        if ((half & 0x7fff) == 0x7bff) continue;
        // Halfway to the next: to the even one; a little on either side: to the nearer.
        const auto next = static_cast<uint16_t>(half + 1);
        const float middle = static_cast<float>((half_by_definition(half) + half_by_definition(next)) / 2);
        ASSERT_EQ(half_of(middle), half & 1 ? next : half);
        ASSERT_EQ(half_of(std::nextafter(middle, value)), half);
        ASSERT_EQ(half_of(std::nextafter(middle, float_of_half(next))), next);
    }
    EXPECT_EQ(half_of(1e30f), 0x7bff);
    EXPECT_EQ(half_of(-INFINITY), 0xfbff);
    EXPECT_EQ(half_of(65519), 0x7bff);
}

}  // namespace
}  // namespace raypager
