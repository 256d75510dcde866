#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "film/film.hpp"
#include "render/adaptive.hpp"

namespace raypager {
namespace {

constexpr uint32_t width = 24, height = 16;

// A film on the host, whose pixels have the noise that they are told to have.
class AdaptiveFilm {
public:
    explicit AdaptiveFilm(const AdaptiveSettings& settings)
        : layout_({}, true), sampling_(settings, layout_), words_(width * height * layout_.words()) {
        for (uint32_t i = 0; i < width * height; i++) add(i, AdaptiveSampling::first_samples);
    }

    // What the renderer does between two stages, the film in pieces.
    SampleStage next() {
        take();
        const SampleStage stage = sampling_.next();
        for (uint32_t row = 0; row < height; row++) sampling_.put(row * width, piece(row));
        return stage;
    }
    Result<SampleStage> resume(uint64_t next_sample) {
        take();
        return sampling_.resume(next_sample);
    }
    // What a damaged checkpoint may say.
    void grant(uint32_t pixel, uint32_t samples) { words_[pixel * layout_.words() + layout_.adaptive_words() + RP_ADAPTIVE_GRANTED] = samples; }
    void set_before(uint32_t pixel, double sum) {
        const auto bits = std::bit_cast<uint64_t>(sum);
        words_[pixel * layout_.words() + layout_.adaptive_words()] = static_cast<uint32_t>(bits);
        words_[pixel * layout_.words() + layout_.adaptive_words() + 1] = static_cast<uint32_t>(bits >> 32);
    }
    void finish(const SampleStage& stage) {
        for (const uint32_t pixel : stage.pixels) add(pixel, stage.passes);
    }
    uint32_t samples(uint32_t pixel) const { return words_[pixel * layout_.words() + RP_FILM_COUNT]; }

private:
    void take() {
        sampling_.begin_taking();
        for (uint32_t row = 0; row < height; row++) sampling_.take(piece(row));
    }
    std::span<uint32_t> piece(uint32_t row) { return std::span(words_).subspan(row * width * layout_.words(), width * layout_.words()); }
    // Noisy on the right, and more so the farther down.
    void add(uint32_t pixel, uint32_t count) {
        const float noise = pixel % width < width / 2 ? 0.0f : 0.2f + 0.05f * static_cast<float>(pixel / width);
        for (uint32_t i = 0; i < count; i++) {
            const float value = 1 + noise * static_cast<float>(normal_(random_));
            add_sample(std::span(words_).subspan(pixel * layout_.words()).first<RP_FILM_WORDS>(), {value, value, value});
        }
    }

    FilmLayout layout_;
    AdaptiveSampling sampling_;
    std::vector<uint32_t> words_;
    std::mt19937 random_{7};
    std::normal_distribution<double> normal_{0, 0.4};
};

AdaptiveSettings settings_of(double error, uint32_t spp) { return {error, width, height, spp, 8}; }

TEST(AdaptiveStages, double_the_samples_of_noisy_pixels_alone) {
    AdaptiveFilm film(settings_of(0.02, 1024));
    uint64_t begun = uint64_t{width} * height * AdaptiveSampling::first_samples;
    uint32_t end = AdaptiveSampling::first_samples;
    size_t before = width * height;
    for (SampleStage stage = film.next(); !stage.pixels.empty(); stage = film.next()) {
        EXPECT_EQ(stage.begin, begun);
        EXPECT_EQ(stage.first_sample, end);
        EXPECT_EQ(stage.passes, end);
        EXPECT_LE(stage.pixels.size(), before);
        before = stage.pixels.size();
        if (end == AdaptiveSampling::first_samples) {
            EXPECT_EQ(before, width * height) << "all have a second half";
        }
        // A render that goes on in the middle of the stage finds the same one.
        const auto again = film.resume(stage.begin + stage.passes / 2);
        ASSERT_TRUE(again.ok()) << again.status().message();
        EXPECT_EQ(again->begin, stage.begin);
        EXPECT_EQ(again->first_sample, stage.first_sample);
        EXPECT_EQ(again->passes, stage.passes);
        EXPECT_EQ(again->pixels, stage.pixels);
        EXPECT_FALSE(film.resume(stage.begin - 1).ok());
        EXPECT_FALSE(film.resume(stage.end() + 1).ok());
        film.finish(stage);
        begun = stage.end();
        end *= 2;
        ASSERT_LE(end, 1024u);
    }
    double quiet = 0, some = 0, much = 0;
    for (uint32_t y = 0; y < height; y++) {
        for (uint32_t x = 0; x + 2 < width / 2; x++) quiet = std::max(quiet, double(film.samples(y * width + x)));
        for (uint32_t x = width / 2 + 1; x < width; x++) (y < height / 2 ? some : much) += film.samples(y * width + x);
    }
    EXPECT_EQ(quiet, 2.0 * AdaptiveSampling::first_samples);
    EXPECT_GT(some, (width / 2 - 1) * (height / 2) * 2.0 * AdaptiveSampling::first_samples);
    EXPECT_GT(much, 1.2 * some);
}

TEST(AdaptiveStages, end_at_the_most_samples) {
    for (const uint32_t spp : {1u, 5u, 8u, 9u, 16u, 20u, 100u}) {
        AdaptiveFilm film(settings_of(1e-4, spp));
        uint32_t end = std::min(spp, AdaptiveSampling::first_samples);
        for (SampleStage stage = film.next(); !stage.pixels.empty(); stage = film.next()) {
            EXPECT_EQ(stage.first_sample, end);
            end += stage.passes;
            film.finish(stage);
            ASSERT_LE(end, spp);
        }
        EXPECT_EQ(end, spp);
    }
}

TEST(AdaptiveStages, have_none_to_go_on_with_before_the_first) {
    AdaptiveFilm film(settings_of(0.1, 64));
    const uint64_t all = uint64_t{width} * height * AdaptiveSampling::first_samples;
    const auto stage = film.resume(all);
    ASSERT_TRUE(stage.ok()) << stage.status().message();
    EXPECT_EQ(stage->passes, 0u);
    EXPECT_TRUE(stage->pixels.empty());
    EXPECT_FALSE(film.resume(all + 1).ok());
}

// Checksums do not say that a film is one that a render has left.
TEST(AdaptiveStages, of_damaged_films_are_refused) {
    for (const uint32_t wrong : {1u, 7u, 8u, 12u, 20u, 63u, 65u, 128u, 0xffffffffu}) {
        AdaptiveFilm film(settings_of(0.01, 64));
        film.grant(5, wrong);
        EXPECT_FALSE(film.resume(width * height * 8).ok()) << wrong;
    }
    AdaptiveFilm film(settings_of(0.01, 64));
    const SampleStage stage = film.next();
    ASSERT_TRUE(film.resume(stage.begin).ok());
    film.set_before(3, NAN);
    EXPECT_FALSE(film.resume(stage.begin).ok());
    film.set_before(3, 8);
    ASSERT_TRUE(film.resume(stage.begin).ok());
    film.grant(3, 64);  // others are to have 16
    EXPECT_FALSE(film.resume(stage.begin).ok());
    film.grant(3, 0);
    EXPECT_FALSE(film.resume(stage.begin).ok());
}

}  // namespace
}  // namespace raypager
