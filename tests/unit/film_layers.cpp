#include "raypager/film_layers.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "film/film.hpp"
#include "film/film_layout.hpp"

namespace raypager {
namespace {

TEST(FilmLayerLists, are_read_and_written) {
    const auto some = parse_film_layers("normal,albedo");
    ASSERT_TRUE(some.ok());
    EXPECT_TRUE(some->has(FilmLayer::albedo) && some->has(FilmLayer::normal) && !some->has(FilmLayer::depth));
    EXPECT_EQ(film_layer_list(*some), "albedo,normal");
    EXPECT_EQ(parse_film_layers("all")->bits(), (1u << film_layer_count) - 1);
    EXPECT_FALSE(FilmLayers().any());
    for (const char* bad : {"", "albedo,", "Albedo", "albedo,,normal", "albedo, normal", "none"}) {
        const auto refused = parse_film_layers(bad);
        ASSERT_FALSE(refused.ok()) << bad;
        EXPECT_EQ(refused.status().kind(), ErrorKind::usage);
        EXPECT_NE(refused.status().message().find("albedo,normal,depth"), std::string::npos) << refused.status().message();
    }
}

TEST(FilmLayouts, have_room_for_each_layer_once) {
    EXPECT_EQ(FilmLayout().words(), uint32_t{RP_FILM_WORDS});
    EXPECT_EQ(FilmLayout().definitions(), "");
    for (uint32_t bits = 0; bits < 1u << film_layer_count; bits++) {
        const FilmLayout layout{FilmLayers(bits)};
        uint32_t next = RP_FILM_WORDS;
        for (uint32_t i = 0; i < film_layer_count; i++) {
            const auto layer = static_cast<FilmLayer>(i);
            if (!layout.layers().has(layer) || layer == FilmLayer::samples) continue;
            EXPECT_EQ(layout.first(layer), next);
            next += layer == FilmLayer::albedo     ? 6
                    : layer == FilmLayer::normal   ? 7
                    : layer == FilmLayer::position ? 3
                    : layer == FilmLayer::variance ? 2
                                                   : 1;
        }
        EXPECT_EQ(layout.words(), next);
    }
    FilmLayers two;
    two.add(FilmLayer::normal);
    two.add(FilmLayer::instance);
    EXPECT_EQ(FilmLayout(two).definitions(), "-DRP_FILM_STRIDE=16u -DRP_HIT_IDS -DRP_FIRST_HITS -DRP_LAYER_NORMAL=8u -DRP_LAYER_INSTANCE=15u ");
}

TEST(FilmResolverWithLayers, finds_each_in_its_words) {
    const FilmLayers layers{~0u};
    const FilmLayout layout{layers};
    std::vector<uint32_t> words(2 * layout.words());
    const auto pixel = std::span(words).last(layout.words());
    add_sample(pixel.first<RP_FILM_WORDS>(), {1, 1, 1});
    add_sample(pixel.first<RP_FILM_WORDS>(), {3, 3, 3});
    const auto set_sum = [&](FilmLayer layer, uint32_t channel, double value) {
        const auto units = static_cast<uint64_t>(std::llround(value * (1u << RP_FILM_SCALE_BITS)));
        pixel[layout.first(layer) + 2 * channel] = static_cast<uint32_t>(units);
        pixel[layout.first(layer) + 2 * channel + 1] = static_cast<uint32_t>(units >> 32);
    };
    set_sum(FilmLayer::albedo, 1, 0.5);
    set_sum(FilmLayer::normal, 0, 0.5);  // (0, 0, -1), of one sample
    set_sum(FilmLayer::normal, 1, 0.5);
    pixel[layout.first(FilmLayer::normal) + RP_NORMAL_LAYER_COUNT] = 1;
    pixel[layout.first(FilmLayer::depth)] = std::bit_cast<uint32_t>(2.5f);
    pixel[layout.first(FilmLayer::position) + 2] = std::bit_cast<uint32_t>(-7.0f);
    pixel[layout.first(FilmLayer::object)] = 3;
    pixel[layout.first(FilmLayer::instance)] = (1u << 24) + 4;
    pixel[layout.first(FilmLayer::material)] = (1u << 24) - 1;
    set_sum(FilmLayer::variance, 0, 10);  // 1 + 9
    pixel[layout.first(FilmLayer::waits)] = 9;

    FilmResolver film(2, 1, {}, false, layout);
    film.add(words);
    const auto images = film.take_layers();
    ASSERT_EQ(images.size(), film_layer_count);
    const auto of = [&](FilmLayer layer) {
        const Image& image = images[static_cast<size_t>(layer)].image;
        EXPECT_EQ(image.channels, film_layer_channels(layer).size());
        return std::vector<float>(image.values.end() - image.channels, image.values.end());
    };
    EXPECT_EQ(of(FilmLayer::albedo), (std::vector<float>{0, 0.25f, 0}));
    EXPECT_EQ(of(FilmLayer::normal), (std::vector<float>{0, 0, -0.5f}));
    EXPECT_EQ(of(FilmLayer::depth), std::vector<float>{2.5f});
    EXPECT_EQ(of(FilmLayer::position), (std::vector<float>{0, 0, -7}));
    EXPECT_EQ(of(FilmLayer::object), std::vector<float>{3});
    EXPECT_EQ(of(FilmLayer::instance), std::vector<float>{5});
    EXPECT_EQ(of(FilmLayer::material), std::vector<float>{16777215});
    EXPECT_EQ(of(FilmLayer::samples), std::vector<float>{2});
    EXPECT_NEAR(of(FilmLayer::variance)[0], 1, 1e-5);  // (10 / 2 - 2 * 2) / (2 - 1)
    EXPECT_EQ(of(FilmLayer::waits), std::vector<float>{9});
    EXPECT_TRUE(std::isinf(images[static_cast<size_t>(FilmLayer::depth)].image.values[0]));

    // The picture's hash is that of the film without; waits do not count in that of the layers, all else does.
    std::vector<uint32_t> light;
    for (size_t i = 0; i < 2; i++) light.insert(light.end(), &words[i * layout.words()], &words[i * layout.words()] + RP_FILM_WORDS);
    EXPECT_EQ(film.hash(), film_hash(light, 2, 1));
    const auto hash_with = [&](FilmLayer changed) {
        std::vector<uint32_t> other = words;
        other[layout.words() + layout.first(changed)]++;
        FilmResolver changed_film(2, 1, {}, false, layout);
        changed_film.add(other);
        return changed_film.layers_hash();
    };
    EXPECT_EQ(hash_with(FilmLayer::waits), film.layers_hash());
    EXPECT_NE(hash_with(FilmLayer::variance), film.layers_hash());
    EXPECT_NE(hash_with(FilmLayer::albedo), film.layers_hash());
}

}  // namespace
}  // namespace raypager
