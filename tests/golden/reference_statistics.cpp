// The statistical comparison itself: it must let noise pass, and find a bias of 2 % at ordinary sample counts.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "reference/path_tracer.hpp"
#include "reference/scenes.hpp"
#include "reference/statistics.hpp"

namespace raypager::reference {
namespace {

// A picture with a gradient and the noise of spp samples whose standard deviation is their mean. A few of the samples are rare and
// bright, as caustics are.
class NoisyPictures {
public:
    explicit NoisyPictures(uint64_t seed) : engine_(seed) {}

    Image make(uint32_t spp, double bias = 0, uint32_t biased_columns = width) {
        Image image;
        image.width = width;
        image.height = height;
        for (uint32_t i = 0; i < width * height; i++) {
            const double brightness = 0.2 + double(i % width) / width, factor = i % width < biased_columns ? 1 + bias : 1;
            for (int channel = 0; channel < 3; channel++) {
                std::gamma_distribution<double> common(spp, 1.0 / spp);
                std::poisson_distribution<int> rare(spp * 1e-4);
                const double value = brightness * (common(engine_) + rare(engine_) * 300.0 / spp);
                image.values.push_back(static_cast<float>(factor * value));
            }
        }
        return image;
    }
    ImagePair pair(uint32_t spp, double bias = 0, uint32_t biased_columns = width) {
        Image first = make(spp, bias, biased_columns);
        return {std::move(first), make(spp, bias, biased_columns)};
    }

    static constexpr uint32_t width = 128, height = 96;

private:
    std::mt19937_64 engine_;
};

TEST(ReferenceStatistics, LetsNoisePass) {
    for (uint64_t seed = 1; seed <= 100; seed++) {
        NoisyPictures pictures(seed);
        const ImagePair reference = pictures.pair(64);
        const StatisticalComparison of_pairs = compare_statistically(pictures.pair(64), reference);
        EXPECT_TRUE(of_pairs.agrees()) << "seed " << seed << ": " << of_pairs.describe();
    }
}

TEST(ReferenceStatistics, NoiseIsAboutOneSigma) {
    NoisyPictures pictures(7);
    const ImagePair reference = pictures.pair(1024);
    const StatisticalComparison comparison = compare_statistically(pictures.pair(1024), reference);
    // Cautious variances are at least the true ones on average; twice the variance would be too cautious to find anything.
    EXPECT_LT(comparison.rms_block_z, 1.1) << comparison.describe();
    EXPECT_GT(comparison.rms_block_z, 0.7) << comparison.describe();
    EXPECT_EQ(comparison.blocks, 16u * 12u);
    // One picture of half the samples, as noisy as a half of the reference: twice the variance of its mean.
    const StatisticalComparison single = compare_statistically(pictures.make(1024), 2, reference);
    EXPECT_TRUE(single.agrees()) << single.describe();
    EXPECT_GT(single.rms_block_z, 0.7) << single.describe();
}

TEST(ReferenceStatistics, FindsTwoPercentEverywhere) {
    for (uint64_t seed = 1; seed <= 20; seed++) {
        NoisyPictures pictures(seed);
        const ImagePair reference = pictures.pair(128);
        for (const double bias : {0.02, -0.02}) {
            const StatisticalComparison comparison = compare_statistically(pictures.pair(128, bias), reference);
            EXPECT_FALSE(comparison.agrees()) << "seed " << seed << ": " << comparison.describe();
            EXPECT_NEAR(comparison.mean_relative_error, bias, 0.01) << "seed " << seed;
        }
    }
}

TEST(ReferenceStatistics, FindsAStripOfTwentyPercent) {
    for (uint64_t seed = 1; seed <= 20; seed++) {
        NoisyPictures pictures(seed);
        const ImagePair reference = pictures.pair(1024);
        // 16 of 128 columns: 24 of 192 blocks.
        const StatisticalComparison comparison = compare_statistically(pictures.pair(1024, 0.2, 16), reference);
        EXPECT_FALSE(comparison.agrees()) << "seed " << seed << ": " << comparison.describe();
        EXPECT_LT(comparison.worst_x, 16u);
    }
}

TEST(ReferenceStatistics, ToleranceLetsAKnownBiasPass) {
    NoisyPictures pictures(3);
    const ImagePair reference = pictures.pair(128);
    const ImagePair biased = pictures.pair(128, 0.02);
    EXPECT_FALSE(compare_statistically(biased, reference).agrees());
    EXPECT_TRUE(compare_statistically(biased, reference, {.relative_tolerance = 0.03}).agrees());
}

TEST(ReferenceStatistics, NotANumberIsNoAgreement) {
    NoisyPictures pictures(4);
    const ImagePair reference = pictures.pair(64);
    ImagePair candidate = pictures.pair(64);
    candidate.second.values[1000] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(compare_statistically(candidate, reference).agrees());
    EXPECT_FALSE(compare_statistically(candidate.second, 2, reference).agrees());
}

TEST(ReferenceStatistics, PicturesWithoutNoiseMayDifferByRounding) {
    Image flat;
    flat.width = 20;  // not a multiple of the block
    flat.height = 9;
    flat.values.assign(3 * 20 * 9, 0.5f);
    Image rounded = flat, other = flat;
    for (float& value : rounded.values) value *= 1 + 1e-6f;
    other.values[3 * (8 * 20 + 19) + 1] *= 1.01f;
    const ImagePair reference{flat, flat};
    EXPECT_TRUE(compare_statistically(ImagePair{rounded, rounded}, reference).agrees());
    const StatisticalComparison comparison = compare_statistically(ImagePair{other, other}, reference);
    EXPECT_FALSE(comparison.agrees());
    EXPECT_EQ(comparison.worst_x, 16u);
    EXPECT_EQ(comparison.worst_y, 8u);
    EXPECT_EQ(comparison.worst_channel, 1u);
}

ImagePair traced_pair(const Scene& scene, uint32_t spp, uint64_t seed) {
    ReferenceSettings settings{.width = 48, .height = 48, .spp = spp, .max_depth = 5, .seed = seed, .threads = 2};
    Image first = trace_reference(scene, settings).value();
    settings.seed++;
    return {std::move(first), trace_reference(scene, settings).value()};
}

// Caustics of mirror and glass are as uneven as noise gets.
TEST(ReferenceStatistics, CornellBoxAgreesWithItself) {
    const Scene scene = cornell_small({.subdivisions = 2});
    const ImagePair reference = traced_pair(scene, 32, 1);
    for (const uint64_t seed : {11, 21, 31}) {
        const StatisticalComparison comparison = compare_statistically(traced_pair(scene, 32, seed), reference);
        EXPECT_TRUE(comparison.agrees()) << "seed " << seed << ": " << comparison.describe();
    }
}

TEST(ReferenceStatistics, FindsATerrainTwoPercentLighter) {
    Scene scene = terrain_small(32, false, {48, 48});
    const ImagePair reference = traced_pair(scene, 64, 1);
    const StatisticalComparison same = compare_statistically(traced_pair(scene, 64, 11), reference);
    EXPECT_TRUE(same.agrees()) << same.describe();
    for (float& channel : scene.materials[0].color) channel *= 1.02f;
    const StatisticalComparison lighter = compare_statistically(traced_pair(scene, 64, 21), reference);
    EXPECT_FALSE(lighter.agrees()) << lighter.describe();
    EXPECT_GT(lighter.mean_relative_error, 0.01);
}

}  // namespace
}  // namespace raypager::reference
