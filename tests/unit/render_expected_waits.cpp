#include <gtest/gtest.h>

#include "render/expected_waits.hpp"

namespace raypager {
namespace {

WaitNeeds two_cores() {
    WaitNeeds needs;
    needs.paths = 18432;
    needs.slots = 64;
    needs.blocks = 887;
    needs.resident_share = 0.02;
    needs.max_depth = 5;
    needs.rays_per_second = 2 * 1.3e6;
    needs.loads_per_second = 10000;
    return needs;
}

// Two cores, 3 M triangles: 0.85 s more than first loads take, and 13.5 s with the sweep.
TEST(ExpectedWaits, are_within_a_factor_of_what_was_measured) {
    WaitNeeds needs = two_cores();
    const double waiting = expected_seconds(needs).waiting;
    EXPECT_GT(waiting, 0.85 / 3);
    EXPECT_LT(waiting, 0.85 * 3);
    EXPECT_FALSE(crawls(expected_seconds(needs))) << "too short to be of interest";
    needs.sweeps = true;
    EXPECT_GT(expected_seconds(needs).waiting, 13.5 / 3);
    EXPECT_LT(expected_seconds(needs).waiting, 13.5 * 3);
    EXPECT_TRUE(crawls(expected_seconds(needs)));
}

TEST(ExpectedWaits, only_what_is_absent_is_waited_for) {
    WaitNeeds needs = two_cores();
    needs.slots = 1;
    EXPECT_TRUE(crawls(expected_seconds(needs)));
    needs.resident_share = 1;
    EXPECT_EQ(expected_seconds(needs).waiting, 0);
    EXPECT_FALSE(crawls(expected_seconds(needs)));
    needs.resident_share = 2;
    EXPECT_EQ(expected_seconds(needs).waiting, 0);
}

// 1920x1080, 192 samples per pixel, an eighth of all memory, on a GPU: a render that pages, not one that crawls.
TEST(ExpectedWaits, ordinary_limits_go_without_a_word) {
    WaitNeeds needs;
    needs.paths = uint64_t{1920} * 1080 * 192;
    needs.slots = 1190000;
    needs.blocks = 1343;
    needs.resident_share = 0.17;
    needs.max_depth = 5;
    needs.rays_per_second = 132 * 3.2e6;
    needs.loads_per_second = 65000;
    EXPECT_FALSE(crawls(expected_seconds(needs)));
    needs.slots = 1024;
    EXPECT_TRUE(crawls(expected_seconds(needs)));
}

}  // namespace
}  // namespace raypager
