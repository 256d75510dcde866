// The tree over lights, and when there is one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "lights/light_choice.hpp"
#include "lights/light_tree.hpp"
#include "support/many_lights.hpp"

namespace raypager {
namespace {

bool is_placed(const rp_light& light) { return light.kind != RP_LIGHT_INFINITE && light.kind != RP_LIGHT_DISTANT; }

std::vector<uint32_t> placed_among(const std::vector<rp_light>& lights) {
    std::vector<uint32_t> placed;
    for (uint32_t i = 0; i < lights.size(); i++)
        if (is_placed(lights[i])) placed.push_back(i);
    return placed;
}

// Every way leads to its light, through nodes whose spheres hold it and whose axes allow for its own.
void expect_sound(const std::vector<rp_light>& lights, const LightTree& tree) {
    const std::vector<uint32_t> placed = placed_among(lights);
    ASSERT_EQ(tree.nodes.size(), 2 * (placed.size() - 1));
    ASSERT_EQ(tree.ways.size(), lights.size());
    for (uint32_t i = 0; i < lights.size(); i++) {
        if (!is_placed(lights[i])) {
            EXPECT_EQ(tree.ways[i], 0u);
            continue;
        }
        const rp_light& light = lights[i];
        double normal[3] = {double(light.e1[1]) * light.e2[2] - double(light.e1[2]) * light.e2[1],
                            double(light.e1[2]) * light.e2[0] - double(light.e1[0]) * light.e2[2],
                            double(light.e1[0]) * light.e2[1] - double(light.e1[1]) * light.e2[0]};
        const double size = std::hypot(normal[0], normal[1], normal[2]);
        uint32_t next = 0;
        for (uint64_t way = tree.ways[i]; way > 1; way >>= 1) {
            ASSERT_FALSE(next & RP_LIGHT_LEAF);
            const rp_light_node& node = tree.nodes[2 * size_t{next} + (way & 1)];
            next = node.next;
            const double own = light.kind == RP_LIGHT_SPHERE ? light.e1[0] : 0;
            EXPECT_LE(std::hypot(light.p[0] - node.center[0], light.p[1] - node.center[1], light.p[2] - node.center[2]) + own, node.radius);
            const double spread = std::atan2(static_cast<double>(node.spread >> 16) / 65535, static_cast<int16_t>(node.spread & 0xffff) / 32767.0);
            if (light.kind != RP_LIGHT_TRIANGLE || light.flags & RP_LIGHT_TWO_SIDED) {
                EXPECT_GT(spread, 3.14);
            } else if (size > 0) {
                double along = 0, squared = 0;
                for (int k = 0; k < 3; k++) {
                    const double axis = static_cast<int32_t>(node.axis << (22 - 10 * k)) >> 22;
                    along += axis * normal[k] / size;
                    squared += axis * axis;
                }
                EXPECT_LE(std::acos(std::clamp(along / std::sqrt(squared), -1.0, 1.0)), spread);
            }
        }
        EXPECT_EQ(next, RP_LIGHT_LEAF | i);
    }
}

TEST(LightTrees, LeadToEveryLight) {
    for (const uint32_t count : {2u, 3u, 17u, 500u}) {
        const std::vector<rp_light> lights = support::many_lights(count, 2, count);
        expect_sound(lights, build_light_tree(lights, placed_among(lights)));
    }
}

TEST(LightTrees, LightsInTheSamePlaceAreHalved) {
    std::vector<rp_light> lights(1000);
    for (rp_light& light : lights) light.kind = RP_LIGHT_POINT, light.radiance[1] = 1;
    // Nothing tells these apart, and each of the others lies as far again as the one before it: the deepest tree that there can be.
    for (size_t i = 0; i < 120; i++) lights[i].p[0] = std::ldexp(1.0f, static_cast<int>(i) - 60);
    const LightTree tree = build_light_tree(lights, placed_among(lights));
    expect_sound(lights, tree);
}

// How much longer ten times as many take: 10 to 15 times; where each looks at all others, 100 times. No clock is that far off, with sanitizers or
// without.
TEST(LightTrees, AreBuiltInTimeThatGrowsLikeTheLights) {
    const auto seconds_for = [](uint32_t count) {
        const std::vector<rp_light> lights = support::many_lights(count, 0, 1);
        const std::vector<uint32_t> placed = placed_among(lights);
        double least = INFINITY;
        for (int attempt = 0; attempt < 3; attempt++) {
            const std::clock_t start = std::clock();
            const LightTree tree = build_light_tree(lights, placed);
            least = std::min(least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
            EXPECT_EQ(tree.nodes.size(), 2 * (placed.size() - 1));
        }
        return least;
    };
    EXPECT_LT(seconds_for(50'000), 40 * seconds_for(5'000));
}

TEST(LightTrees, AreForSeveralLamps) {
    const rp_light point = support::many_lights(1, 0, 2)[0], sky = [] {
        rp_light light = {};
        light.kind = RP_LIGHT_INFINITE;
        light.radiance[0] = 1;
        return light;
    }();
    rp_light dark = point;
    for (float& channel : dark.radiance) channel = 0;
    const rp_light near = triangle_light({0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {{1, 1, 1}}),
                   other = triangle_light({0, 0, 0}, {1, 0, 1}, {0, 0, 1}, {{1, 1, 1}});
    const rp_light apart = triangle_light({9, 0, 0}, {10, 0, 1}, {9, 0, 1}, {{1, 1, 1}});
    const auto has_tree = [](std::vector<rp_light> lights) { return has_light_tree(lights); };
    EXPECT_FALSE(has_tree({}));
    EXPECT_FALSE(has_tree({sky, point}));
    EXPECT_FALSE(has_tree({point, dark, sky}));
    EXPECT_FALSE(has_tree({near, other, sky}));  // a square
    EXPECT_TRUE(has_tree({near, apart}));
    EXPECT_TRUE(has_tree({near, other, point}));
    EXPECT_TRUE(has_tree({point, near}));
}

// Without a tree, too: bytes as said, and probabilities that are shares of numbers.
TEST(LightTrees, WordsTakeTheirBytes) {
    for (const uint32_t count : {0u, 1u, 2u, 100u}) {
        std::vector<rp_light> lights = support::many_lights(count, 3, 7);
        const std::vector<uint32_t> words = light_choice(lights);
        EXPECT_EQ(words.size() * sizeof(uint32_t), light_choice_bytes(lights)) << count;
    }
    std::vector<rp_light> none;
    EXPECT_TRUE(light_choice(none).empty());
}

}  // namespace
}  // namespace raypager
