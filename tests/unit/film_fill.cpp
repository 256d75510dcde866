// Pixels without samples take the colours around them.
#include <gtest/gtest.h>

#include "film/fill.hpp"
#include "film/film.hpp"

namespace raypager {
namespace {

Image flat(uint32_t width, uint32_t height, float value) { return {width, height, 3, std::vector<float>(size_t{3} * width * height, value)}; }

TEST(FilmFill, ConstantPicturesStayConstant) {
    Image image = flat(13, 7, 0.25f);
    std::vector<bool> unsampled(13 * 7, true);
    unsampled[20] = false;
    for (size_t at = 0; at < unsampled.size(); at++)
        if (unsampled[at]) image.values[3 * at] = image.values[3 * at + 1] = image.values[3 * at + 2] = 0;
    fill_unsampled(image, unsampled);
    for (const float value : image.values) EXPECT_FLOAT_EQ(value, 0.25f);
}

TEST(FilmFill, ColoursComeFromNearby) {
    Image image = flat(64, 4, 0);
    std::vector<bool> unsampled(64 * 4, true);
    for (size_t y = 0; y < 4; y++)
        for (const size_t x : {0u, 63u}) {
            unsampled[64 * y + x] = false;
            image.values[3 * (64 * y + x)] = x == 0 ? 1.0f : 3.0f;
        }
    const Image before = image;
    fill_unsampled(image, unsampled);
    for (size_t at = 0; at < unsampled.size(); at++) {
        EXPECT_GE(image.values[3 * at], 1.0f);
        EXPECT_LE(image.values[3 * at], 3.0f);
        EXPECT_EQ(image.values[3 * at + 1], 0.0f);
        if (!unsampled[at]) {
            EXPECT_EQ(image.values[3 * at], before.values[3 * at]) << "sampled pixels stay as they are";
        }
    }
    EXPECT_LT(image.values[3 * 4], 1.5f);
    EXPECT_GT(image.values[3 * 59], 2.5f);
}

TEST(FilmFill, WithoutAnySampleNothingChanges) {
    Image image = flat(5, 3, 0);
    fill_unsampled(image, std::vector<bool>(15, true));
    EXPECT_EQ(image.values, flat(5, 3, 0).values);
}

TEST(FilmFill, FilmsCountAndFillThem) {
    std::vector<uint32_t> words(4 * RP_FILM_WORDS);
    for (const size_t pixel : {0u, 3u}) add_sample(std::span<uint32_t, RP_FILM_WORDS>(&words[pixel * RP_FILM_WORDS], RP_FILM_WORDS), {2, 2, 2});
    FilmResolver film(2, 2);
    film.add(words);
    EXPECT_EQ(film.unsampled(), 2u);
    EXPECT_EQ(film.hash(), film_hash(words, 2, 2)) << "the film itself stays as it is";
    for (const float value : film.take_image().values) EXPECT_FLOAT_EQ(value, 2);
}

// Means that go with the picture are filled as it is; what is of single samples stays empty.
TEST(FilmFill, FilmsFillAlbedosAndNormals) {
    FilmLayers layers;
    for (const FilmLayer layer : {FilmLayer::albedo, FilmLayer::normal, FilmLayer::material}) layers.add(layer);
    const FilmLayout layout{layers};
    std::vector<uint32_t> words(4 * layout.words());
    const auto pixel = std::span(words).first(layout.words());
    add_sample(pixel.first<RP_FILM_WORDS>(), {2, 2, 2});
    for (size_t i = 0; i < 3; i++) pixel[layout.first(FilmLayer::albedo) + 2 * i] = 1u << (RP_FILM_SCALE_BITS - 1);
    for (size_t i = 0; i < 3; i++) pixel[layout.first(FilmLayer::normal) + 2 * i] = 3u << (RP_FILM_SCALE_BITS - 2);  // packed as (1 + n) / 2
    pixel[layout.first(FilmLayer::normal) + RP_NORMAL_LAYER_COUNT] = 1;
    pixel[layout.first(FilmLayer::material)] = 7;
    FilmResolver film(2, 2, {}, false, layout);
    film.add(words);
    const auto images = film.take_layers();
    ASSERT_EQ(images.size(), 3u);
    for (const float value : images[0].image.values) EXPECT_FLOAT_EQ(value, 0.5f);
    for (const float value : images[1].image.values) EXPECT_FLOAT_EQ(value, 0.5f);
    EXPECT_EQ(images[2].image.values, (std::vector<float>{7, 0, 0, 0}));
}

}  // namespace
}  // namespace raypager
