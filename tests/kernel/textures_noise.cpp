// What textures are made of beside images, on the device against double precision: coordinates (kernels/shading/texture.cl), angles and noise.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "support/texture_probe.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

struct NoisePoint {
    double x, y, z;
    NoisePoint times(double s) const { return {s * x, s * y, s * z}; }
};

// Perlin's permutation, as in "Improving Noise" (2002).
constexpr std::array<uint8_t, 256> noise_table = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,  69,  142, 8,   99,  37,  240, 21,  10,  23,
    190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,  94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,
    125, 136, 171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122, 60,  211, 133, 230, 220, 105, 92,
    41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161, 1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130,
    116, 188, 159, 86,  164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126, 255, 82,  85,  212, 207,
    206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213, 119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,
    172, 9,   129, 22,  39,  253, 19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193, 238, 210, 144,
    12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,  181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,
    127, 4,   150, 254, 138, 236, 205, 93,  222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

// Of pbrt, or of Perlin's paper, whose last four are others.
double gradient(uint32_t h, double x, double y, double z, bool of_paper) {
    h &= 15;
    const double u = h < 8 || (!of_paper && (h == 12 || h == 13)) ? x : y;
    const double v = h < 4 ? y : of_paper ? (h == 12 || h == 14 ? x : z) : (h == 12 || h == 13 ? y : z);
    return (h & 1 ? -u : u) + (h & 2 ? -v : v);
}

double noise_at(const NoisePoint& p, bool of_paper = false) {
    const double whole[] = {std::floor(p.x), std::floor(p.y), std::floor(p.z)}, d[] = {p.x - whole[0], p.y - whole[1], p.z - whole[2]};
    const auto hash = [](uint32_t a, int64_t i) { return uint32_t{noise_table[static_cast<size_t>((a + i) & 255)]}; };
    const auto weight = [](double t) { return ((6 * t - 15) * t + 10) * t * t * t; };
    double sum = 0;
    for (int corner = 0; corner < 8; corner++) {
        const int at[] = {corner & 1, corner >> 1 & 1, corner >> 2};
        double share = 1;
        uint32_t h = 0;
        for (int axis = 0; axis < 3; axis++) {
            h = hash(h, static_cast<int64_t>(whole[axis]) + at[axis]);
            share *= at[axis] ? weight(d[axis]) : 1 - weight(d[axis]);
        }
        sum += share * gradient(h, d[0] - at[0], d[1] - at[1], d[2] - at[2], of_paper);
    }
    return sum;
}

double octaves_at(const NoisePoint& p, double width, double omega, int octaves, bool folded) {
    const double n = std::min(std::max(width > 0 ? -1 - std::log2(width) : 1e9, 0.0), double(octaves)), whole = std::floor(n);
    const auto of = [&](double i) {
        const double v = noise_at(p.times(std::pow(1.99, i)));
        return folded ? std::abs(v) : v;
    };
    double sum = 0;
    for (double i = 0; i < whole; i++) sum += std::pow(omega, i) * of(i);
    const double t = std::min(std::max((n - whole - 0.3) / 0.4, 0.0), 1.0), part = t * t * (3 - 2 * t);
    if (!folded) return sum + std::pow(omega, whole) * part * of(whole);
    sum += std::pow(omega, whole) * (0.2 + part * (of(whole) - 0.2));
    for (double i = whole; i < octaves; i++) sum += 0.2 * std::pow(omega, i);
    return sum;
}

double windy_at(const NoisePoint& p, double width) {
    return std::abs(octaves_at(p.times(0.1), 0.1 * width, 0.5, 3, false)) * octaves_at(p, width, 0.5, 6, false);
}

std::array<double, 3> marble_at(const NoisePoint& p, double width, double omega, int octaves, double variation) {
    constexpr double colors[9][3] = {{.58, .58, .6}, {.58, .58, .6}, {.58, .58, .6}, {.5, .5, .5},  {.6, .59, .58},
                                     {.58, .58, .6}, {.58, .58, .6}, {.2, .2, .33},  {.58, .58, .6}};
    const double t = 3 + 3 * std::sin(p.y + variation * octaves_at(p, width, omega, octaves, false));
    const auto first = static_cast<size_t>(std::min(std::floor(t), 5.0));
    const double f = t - static_cast<double>(first), g = 1 - f, weights[] = {g * g * g, 3 * f * g * g, 3 * f * f * g, f * f * f};
    std::array<double, 3> sum{};
    for (size_t i = 0; i < 4; i++)
        for (size_t k = 0; k < 3; k++) sum[k] += 1.5 * weights[i] * colors[first + i][k];
    return sum;
}

// How far inside of a dot, as a distance; less than 0: outside.
double depth_in_dot(double s, double t) {
    const double i = std::floor(s + 0.5), j = std::floor(t + 0.5);
    if (noise_at({i + 0.5, j + 0.5, 0.5}) <= 0) return -1;
    return 0.35 - std::hypot(s - i - 0.15 * noise_at({i + 1.5, j + 2.8, 0.5}), t - j - 0.15 * noise_at({i + 4.5, j + 9.8, 0.5}));
}

struct NoiseItem {
    float x, y, z, width = 0;
    uint32_t kind = RP_NONE;
    float octaves = 0, omega = 0, variation = 0;
    NoisePoint point() const { return {x, y, z}; }
};

class TextureNumbersOnDevice : public testing::Test {
protected:
    std::vector<std::array<float, 4>> noises(const std::vector<NoiseItem>& items) {
        return probe_.run<std::array<float, 4>>("rp_probe_noise", items, items.size());
    }
    // Points of cubes of all sizes around the origin.
    NoiseItem random_point(float most) {
        std::uniform_real_distribution<float> share(-1, 1);
        const float size = most * std::exp2(10 * std::min(share(random_), 0.0f));
        return {size * share(random_), size * share(random_), size * share(random_)};
    }
    Scene scene_;
    support::TextureProbe probe_{scene_};
    std::mt19937 random_{31};
};

// The permutation is Perlin's: a value that his own program gives, with his gradients.
TEST_F(TextureNumbersOnDevice, NoiseIsPerlins) {
    EXPECT_NEAR(noise_at({3.14, 42, 7}, true), 0.13691995878400012, 1e-15);
    std::vector<NoiseItem> items;
    for (int i = 0; i < 10000; i++) items.push_back(random_point(500));
    const auto found = noises(items);
    for (size_t i = 0; i < items.size(); i++) {
        EXPECT_NEAR(found[i][0], noise_at(items[i].point()), 2e-6) << items[i].x << ' ' << items[i].y << ' ' << items[i].z;
        EXPECT_LE(std::abs(found[i][0]), 1.0f);
    }
}

TEST_F(TextureNumbersOnDevice, NoiseIsContinuousAndZeroAtWholePoints) {
    std::vector<NoiseItem> whole, below, above;
    for (int i = 0; i < 3000; i++) {
        NoiseItem p = random_point(300);
        whole.push_back({std::rint(p.x), std::rint(p.y), std::rint(p.z)});
        float* const across[] = {&p.x, &p.y, &p.z};
        float& x = *across[i % 3];
        x = std::rint(x);
        above.push_back(p);
        x = std::nextafter(x, -1e9f);
        below.push_back(p);
    }
    for (const auto& found : noises(whole)) EXPECT_EQ(found[0], 0);
    const auto a = noises(below), b = noises(above);
    // Steps are of 2^-15 at 300, and its slope is no more than 3.
    for (size_t i = 0; i < a.size(); i++) EXPECT_NEAR(a[i][0], b[i][0], 1e-4);
    for (const float far : {0x1p23f, -0x1p23f, 3e38f, -3e38f}) EXPECT_EQ(noises({{far, 1.5f, far}})[0][0], noises({{far, 1.5f, far}})[0][0]) << far;
}

TEST_F(TextureNumbersOnDevice, WhatIsMadeOfNoiseIsAsInDoublePrecision) {
    constexpr uint32_t kinds[] = {RP_TEXTURE_FBM, RP_TEXTURE_WRINKLED, RP_TEXTURE_WINDY, RP_TEXTURE_MARBLE};
    std::uniform_real_distribution<float> share(0, 1);
    std::vector<NoiseItem> items;
    for (int i = 0; i < 8000; i++) {
        NoiseItem item = random_point(50);
        item.width = i % 5 == 0 ? 0.0f : std::exp2(-10 * share(random_));
        item.kind = kinds[i % 4];
        item.octaves = static_cast<float>(random_() % 9);
        item.omega = share(random_);
        item.variation = 2 * share(random_);
        items.push_back(item);
    }
    double worst[4] = {};
    const auto found = noises(items);
    for (size_t i = 0; i < items.size(); i++) {
        const NoiseItem& item = items[i];
        const int octaves = static_cast<int>(item.octaves);
        std::array<double, 3> expected{};
        if (item.kind == RP_TEXTURE_MARBLE) expected = marble_at(item.point(), item.width, item.omega, octaves, item.variation);
        if (item.kind == RP_TEXTURE_WINDY) expected.fill(windy_at(item.point(), item.width));
        if (item.kind == RP_TEXTURE_FBM || item.kind == RP_TEXTURE_WRINKLED)
            expected.fill(octaves_at(item.point(), item.width, item.omega, octaves, item.kind == RP_TEXTURE_WRINKLED));
        // Places within the finest octave, 1.99^8 times as far away, are rounded.
        for (size_t k = 0; k < 3; k++) {
            EXPECT_NEAR(found[i][k], expected[k], 2e-3)
                << item.kind << " at " << item.x << ' ' << item.y << ' ' << item.z << ", width " << item.width << ", octaves " << octaves;
            worst[i % 4] = std::max(worst[i % 4], std::abs(found[i][k] - expected[k]));
        }
    }
    std::printf("octaves are off by %.1e, wrinkles by %.1e, waves by %.1e, marble by %.1e at most\n", worst[0], worst[1], worst[2], worst[3]);
}

TEST_F(TextureNumbersOnDevice, DotsAreWherePbrtHasThem) {
    std::vector<NoiseItem> items;
    for (int i = 0; i < 10000; i++) {
        items.push_back(random_point(60));
        items.back().kind = RP_TEXTURE_DOTS;
    }
    const auto found = noises(items);
    size_t inside = 0, doubtful = 0;
    for (size_t i = 0; i < items.size(); i++) {
        const double depth = depth_in_dot(items[i].x, items[i].y);
        if (std::abs(depth) < 1e-5) {
            doubtful++;
            continue;
        }
        inside += depth > 0;
        EXPECT_EQ(found[i][0] != 0, depth > 0) << items[i].x << ' ' << items[i].y << ": " << depth;
    }
    EXPECT_LT(doubtful, 20u);
    EXPECT_GT(inside, items.size() / 20);
}

// As operations of programs, in coordinates of their own; b + (a - b) noise, for colours are no less than 0.
TEST(NoisyPrograms, AreOfTheNoiseThatTheyName) {
    constexpr uint32_t kinds[] = {RP_TEXTURE_FBM, RP_TEXTURE_WRINKLED, RP_TEXTURE_WINDY, RP_TEXTURE_MARBLE, RP_TEXTURE_DOTS};
    constexpr float octaves = 5, omega = 0.6f, scale = 3, variation = 0.7f, size = 2;
    Scene scene;
    scene.texture_maps = {{RP_MAP_POINT, 0, {}, {size, 0, 0, 0.5f, 0, size, 0, 0, 0, 0, size, -0.25f}, {1, 1}, {0, 0}}};
    for (const uint32_t kind : kinds) {
        rp_material m = {};
        m.flags = static_cast<uint32_t>(scene.texture_ops.size() + 1) << RP_MATERIAL_PROGRAM_SHIFT;
        scene.materials.push_back(m);
        scene.texture_ops.push_back({RP_TEXTURE_CONSTANT, 0, 0, RP_NONE, {0.5f, 0.5f, 0.5f, 0}, {}});
        scene.texture_ops.push_back({RP_TEXTURE_CONSTANT, 0, 0, RP_NONE, {0.75f, 0.75f, 0.75f, 0}, {}});
        scene.texture_ops.push_back({kind, 0, 0, 0, {octaves, omega, scale, 0}, {variation, 0, 0, 0}});
        if (kind != RP_TEXTURE_DOTS) scene.texture_ops.push_back({RP_TEXTURE_MIX, 0, 0, RP_NONE, {}, {}});
        scene.texture_ops.push_back({RP_TEXTURE_SET | RP_TEXTURE_LAST, RP_PARAMETER_COLOR, 0, RP_NONE, {}, {}});
    }
    support::TextureProbe probe(scene);
    std::mt19937 random(8);
    std::uniform_real_distribution<float> any(-5, 5);
    std::vector<support::ProgramSite> sites(2000);
    for (uint32_t i = 0; i < sites.size(); i++) {
        for (float& x : sites[i].position) x = any(random);
        sites[i].width = std::exp2(any(random) - 5);
        sites[i].material = i % 5;
    }
    std::vector<support::SlotTexels> texels;
    std::vector<rp_material> found;
    probe.run_programs(sites, texels, found);
    for (size_t i = 0; i < sites.size(); i++) {
        const float* const at = sites[i].position;
        const NoisePoint p{size * at[0] + 0.5, size * at[1], size * at[2] - 0.25};
        const double width = size * sites[i].width;
        std::array<double, 3> v{};
        if (sites[i].material < 2) v.fill(octaves_at(p, width, omega, 5, sites[i].material == 1));
        if (sites[i].material == 2) v.fill(windy_at(p, width));
        if (sites[i].material == 3) v = marble_at(p.times(scale), scale * width, omega, 5, variation);
        const double depth = depth_in_dot(p.x, p.y);
        if (sites[i].material == 4) v.fill(depth > 0 ? 0 : 1);
        if (sites[i].material == 4 && std::abs(depth) < 1e-5) continue;
        for (size_t k = 0; k < 3; k++) EXPECT_NEAR(found[i].color[k], std::min(0.5 + 0.25 * v[k], 1.0), 1e-4) << "kind " << kinds[i % 5];
    }
}

// The bounds of the comments in angles.cl and texture.cl.
TEST_F(TextureNumbersOnDevice, AnglesAndLogarithmsAreWithinTheirBounds) {
    std::vector<std::array<float, 2>> items = {{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, -1e-9f}, {1, 1e-9f}, {-1, -1e-9f}, {1e-30f, 1e-30f}};
    std::uniform_real_distribution<float> share(-1, 1), exponent(-20, 20);
    for (int i = 0; i < 20000; i++) {
        const double angle = pi * share(random_), size = std::exp2(exponent(random_));
        items.push_back({static_cast<float>(size * std::cos(angle)), static_cast<float>(size * std::sin(angle))});
    }
    const auto found = probe_.run<std::array<float, 2>>("rp_probe_numbers", items, items.size());
    double most = 0, log_most = 0;
    for (size_t i = 0; i < items.size(); i++) {
        const double turns = std::atan2(double{items[i][1]}, double{items[i][0]}) / (2 * pi), off = found[i][0] - turns;
        most = std::max(most, std::abs(off - std::rint(off)));
        EXPECT_GE(found[i][0], 0);
        EXPECT_LE(found[i][0], 1) << items[i][0] << ' ' << items[i][1];
        if (items[i][0] > 0) log_most = std::max(log_most, std::abs(found[i][1] - std::log2(double{items[i][0]})));
    }
    std::printf("angles are off by %.1e of a turn, logarithms by %.4f at most\n", most, log_most);
    EXPECT_LT(most, 1.2e-7);
    EXPECT_LT(log_most, 0.009);
}

}  // namespace
}  // namespace raypager
