// The film's fixed-point sums: exact conversion, any order, honest counts.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "film/fill.hpp"
#include "film/film.hpp"

namespace raypager {
namespace {

uint64_t fixed(float value) {
    const auto [low, high] = to_fixed_point(value);
    return uint64_t{high} << 32 | low;
}

uint64_t fixed_by_double(float value) { return static_cast<uint64_t>(std::ldexp(static_cast<double>(value), RP_FILM_SCALE_BITS)); }

std::vector<std::array<float, 3>> random_samples(size_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<std::array<float, 3>> samples(count);
    for (auto& sample : samples)
        for (float& value : sample) value = std::ldexp(static_cast<float>(random() >> 8), -static_cast<int>(random() % 50));
    return samples;
}

TEST(FilmFixedPoint, EqualsTheConversionInDouble) {
    for (const float value : {0.0f, 1e-45f, 1e-38f, 3.7252903e-9f, 1.0f, 15.999999f, 16.0f, 16.000002f, 1048575.9f, RP_FILM_MAX_RADIANCE})
        EXPECT_EQ(fixed(value), fixed_by_double(value)) << value;
    const uint32_t seed = 20240601;
    std::mt19937 random(seed);
    const auto largest = std::bit_cast<uint32_t>(RP_FILM_MAX_RADIANCE);
    for (int i = 0; i < 2'000'000; i++) {
        const auto value = std::bit_cast<float>(static_cast<uint32_t>(random()) % (largest + 1));  // even over exponents
        ASSERT_EQ(fixed(value), fixed_by_double(value)) << value << ", seed " << seed;
    }
}

TEST(FilmAccumulate, AnyOrderGivesTheSameWords) {
    const uint32_t seed = 7;
    auto samples = random_samples(3000, seed);
    samples[5] = {NAN, 1, -1};
    samples[6] = {INFINITY, 0, 3e6f};
    std::array<uint32_t, RP_FILM_WORDS> first{};
    for (const auto& sample : samples) add_sample(first, sample);
    std::mt19937 random(seed);
    for (int order = 0; order < 20; order++) {
        std::shuffle(samples.begin(), samples.end(), random);
        std::array<uint32_t, RP_FILM_WORDS> again{};
        for (const auto& sample : samples) add_sample(again, sample);
        ASSERT_EQ(first, again) << "order " << order << ", seed " << seed;
    }
}

TEST(FilmAccumulate, CarriesIntoTheHighWord) {
    std::array<uint32_t, RP_FILM_WORDS> pixel{};
    for (int i = 0; i < 65535; i++) add_sample(pixel, {RP_FILM_MAX_RADIANCE, 15.5f, 0.25f});
    const Image image = resolve_film(pixel, 1, 1);
    EXPECT_EQ(image.values, (std::vector<float>{RP_FILM_MAX_RADIANCE, 15.5f, 0.25f}));
    EXPECT_EQ(clamped_samples(pixel), 0u);
}

TEST(FilmAccumulate, CountsWhatItChanges) {
    std::vector<uint32_t> words(2 * RP_FILM_WORDS);
    const std::span<uint32_t, RP_FILM_WORDS> pixel(words.data(), RP_FILM_WORDS);
    add_sample(pixel, {NAN, NAN, 1});
    add_sample(pixel, {-1, 2, 3});
    add_sample(pixel, {INFINITY, 0, 0});
    add_sample(pixel, {1, 1, 1});
    add_sample(pixel, {-0.0f, 0, 0});  // minus zero is zero
    EXPECT_EQ(clamped_samples(words), 3u);
    EXPECT_EQ(average_samples(words), 2.5) << "five samples on two pixels";
    const Image image = resolve_film(words, 1, 2);
    EXPECT_EQ(image.values[0], (RP_FILM_MAX_RADIANCE + 1) / 5);
    EXPECT_EQ(image.values[1], 3.0f / 5);
    EXPECT_EQ(image.values[2], 5.0f / 5);
    EXPECT_EQ(image.values[3], 0) << "no samples: black";
}

TEST(FilmHash, TellsSizeAndEveryWord) {
    std::vector<uint32_t> words(6 * RP_FILM_WORDS, 1);
    const uint64_t hash = film_hash(words, 3, 2);
    EXPECT_EQ(hash, film_hash(words, 3, 2));
    EXPECT_NE(hash, film_hash(words, 2, 3));
    for (size_t i = 0; i < words.size(); i++) {
        words[i] ^= 0x80;
        EXPECT_NE(hash, film_hash(words, 3, 2)) << "word " << i;
        words[i] ^= 0x80;
    }
}

TEST(FilmResponse, ExposureAndColoursAreAppliedToTheMean) {
    std::array<uint32_t, RP_FILM_WORDS> pixel{};
    add_sample(pixel, {1, 2, 3});
    add_sample(pixel, {3, 2, 1});
    FilmResponse response;
    response.exposure = 4;
    response.color_matrix = {0, 1, 0, 0, 0, 1, 0.5f, 0, 0.25f};
    EXPECT_EQ(resolve_film(pixel, 1, 1, response).values, (std::vector<float>{8, 8, 6}));
    FilmResolver resolver(1, 1, response);
    resolver.add(pixel);
    EXPECT_EQ(resolver.take_image().values, (std::vector<float>{8, 8, 6}));
}

TEST(FilmResponse, LimitsScaleASampleAsAWhole) {
    FilmResponse response;
    const std::array<float, 3> sample = {4, 8, 12};
    EXPECT_EQ(limit_sample(sample, response), sample);
    response.max_luminance = 0.5f;
    auto limited = limit_sample(sample, response);
    EXPECT_NEAR(0.2126729f * limited[0] + 0.7151522f * limited[1] + 0.0721750f * limited[2], 0.5, 1e-6);
    EXPECT_NEAR(limited[2] / limited[0], 3, 1e-5);
    response = {};
    response.max_xyz = 1;  // Z is the largest here
    limited = limit_sample(sample, response);
    EXPECT_NEAR(0.0193339f * limited[0] + 0.1191920f * limited[1] + 0.9503041f * limited[2], 1, 1e-6);
    EXPECT_NEAR(limited[1] / limited[0], 2, 1e-5);
    EXPECT_EQ(limit_sample({0.1f, 0.2f, 0.3f}, response), (std::array<float, 3>{0.1f, 0.2f, 0.3f})) << "dark enough";
}

// A film in pieces gives what the whole gives.
TEST(FilmResolver, AgreesWithTheWholeFilm) {
    std::vector<uint32_t> words(6 * RP_FILM_WORDS);
    for (size_t i = 0; i < 5; i++)  // the last pixel stays without samples
        for (size_t k = 0; k <= i; k++)
            add_sample(std::span<uint32_t, RP_FILM_WORDS>(words.data() + i * RP_FILM_WORDS, RP_FILM_WORDS), {0.25f * static_cast<float>(i), -1, NAN});
    FilmResolver resolver(3, 2);
    size_t at = 0;
    for (const size_t pixels : {1u, 3u, 2u}) {
        resolver.add(std::span(words).subspan(at * RP_FILM_WORDS, pixels * RP_FILM_WORDS));
        at += pixels;
    }
    EXPECT_EQ(resolver.hash(), film_hash(words, 3, 2));
    EXPECT_EQ(resolver.samples(), 15u);
    EXPECT_EQ(resolver.clamped(), clamped_samples(words));
    EXPECT_EQ(resolver.unsampled(), 1u);
    // The pixel without samples shows what is around it, where the whole film leaves it black.
    Image whole = resolve_film(words, 3, 2);
    fill_unsampled(whole, {false, false, false, false, false, true});
    EXPECT_EQ(resolver.take_image().values, whole.values);
}

// The number of samples shares its word with how many of them met nothing.
TEST(FilmResolve, AlphaComesFromTheSamplesThatMetNothing) {
    std::vector<uint32_t> words(2 * RP_FILM_WORDS);
    const auto first = std::span(words).first<RP_FILM_WORDS>();
    for (int i = 0; i < 3; i++) add_sample(first, {1, 2, 4});
    add_sample(first, {0, 0, 0});
    words[RP_FILM_COUNT] += 1u << RP_FILM_MISSES_SHIFT;
    const Image image = resolve_film(words, 2, 1, {}, true);
    ASSERT_EQ(image.channels, 4u);
    EXPECT_EQ(image.values, (std::vector<float>{0.75f, 1.5f, 3, 0.75f, 0, 0, 0, 0}));
    EXPECT_EQ(resolve_film(words, 2, 1).values, (std::vector<float>{0.75f, 1.5f, 3, 0, 0, 0}));
    EXPECT_EQ(average_samples(words), 2);
    // As many as there can be.
    words[RP_FILM_COUNT] = 65535u | 65535u << RP_FILM_MISSES_SHIFT;
    EXPECT_EQ(resolve_film(words, 2, 1, {}, true).values[3], 0);
    FilmResolver resolver(2, 1, {}, true);
    resolver.add(words);
    EXPECT_EQ(resolver.samples(), 65535u);
    // The pixel without samples has the colour and the alpha of the one beside it.
    Image whole = resolve_film(words, 2, 1, {}, true);
    fill_unsampled(whole, {false, true});
    EXPECT_EQ(resolver.take_image().values, whole.values);
}

}  // namespace
}  // namespace raypager
