// The film of several devices is the sum of theirs.
#include <gtest/gtest.h>

#include <random>

#include "film/add_films.hpp"
#include "film/film.hpp"

namespace raypager {
namespace {

TEST(FilmAdder, ends_in_the_film_of_all_samples) {
    constexpr uint32_t seed = 3;
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> radiance(-1, 1 << 20);
    const FilmAdder adder{FilmLayout()};
    for (int trial = 0; trial < 50; trial++) {
        std::vector<uint32_t> all(2 * RP_FILM_WORDS), first = all, second = all;
        for (int i = 0; i < 200; i++) {
            const std::array<float, 3> color = {radiance(random), radiance(random), radiance(random)};
            const size_t at = random() % 2 * RP_FILM_WORDS;
            add_sample(std::span<uint32_t, RP_FILM_WORDS>(&all[at], RP_FILM_WORDS), color);
            std::vector<uint32_t>& part = random() % 3 ? first : second;
            add_sample(std::span<uint32_t, RP_FILM_WORDS>(&part[at], RP_FILM_WORDS), color);
        }
        adder.add(first, second);
        ASSERT_EQ(first, all) << "seed " << seed;
    }
}

TEST(FilmAdder, keeps_what_the_first_sample_met) {
    const FilmLayout layout(*parse_film_layers("all"));
    const FilmAdder adder(layout);
    std::vector<uint32_t> first(layout.words()), second(layout.words());
    const auto at = [&](FilmLayer layer) { return layout.first(layer); };
    second[at(FilmLayer::depth)] = first[at(FilmLayer::depth)] = 0x3f800000;
    second[at(FilmLayer::material)] = 7;
    // Devices of two kinds, whose last bits differ.
    first[at(FilmLayer::position)] = 0x3f7fffff;
    second[at(FilmLayer::position)] = 0x3f800000;
    first[at(FilmLayer::waits)] = 3;
    second[at(FilmLayer::waits)] = 4;
    first[at(FilmLayer::variance)] = second[at(FilmLayer::variance)] = 0x80000000;
    first[at(FilmLayer::albedo) + 2] = 0xffffffff;
    second[at(FilmLayer::albedo) + 2] = 1;
    second[at(FilmLayer::albedo) + 3] = 5;
    first[at(FilmLayer::normal) + RP_NORMAL_LAYER_COUNT] = second[at(FilmLayer::normal) + RP_NORMAL_LAYER_COUNT] = 20;
    adder.add(first, second);
    EXPECT_EQ(first[at(FilmLayer::depth)], 0x3f800000u);
    EXPECT_EQ(first[at(FilmLayer::material)], 7u);
    EXPECT_EQ(first[at(FilmLayer::position)], 0x3f800000u);
    EXPECT_EQ(first[at(FilmLayer::waits)], 7u);
    EXPECT_EQ(first[at(FilmLayer::variance)], 0u);
    EXPECT_EQ(first[at(FilmLayer::variance) + 1], 1u);
    EXPECT_EQ(first[at(FilmLayer::albedo) + 2], 0u);
    EXPECT_EQ(first[at(FilmLayer::albedo) + 3], 6u);
    EXPECT_EQ(first[at(FilmLayer::normal) + RP_NORMAL_LAYER_COUNT], 40u);
}

}  // namespace
}  // namespace raypager
