// Levels and tiles against a plain model, texel by texel.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <random>

#include "base/half.hpp"
#include "image/formats.hpp"
#include "raypager/image_source.hpp"
#include "support/textured_scene.hpp"
#include "texture/layout.hpp"
#include "texture/texel_codec.hpp"
#include "texture/tiler.hpp"

namespace raypager {
namespace {

using Pages = std::map<uint32_t, std::vector<std::byte>>;

struct Tiled {
    ImageLayout layout;
    Pages pages;
};

Tiled tile_all(const std::vector<std::pair<ImageShape, std::vector<std::byte>>>& images, size_t rows_at_once = SIZE_MAX) {
    std::vector<ImageShape> shapes;
    for (const auto& [shape, texels] : images) {
        EXPECT_TRUE(check_image_shape(shape, "image").ok());
        shapes.push_back(shape);
    }
    auto layout = lay_out_images(shapes);
    EXPECT_TRUE(layout.ok());
    Tiled tiled{*layout, {}};
    for (size_t i = 0; i < images.size(); i++) {
        const auto& [shape, texels] = images[i];
        const rp_image& image = layout->images[i];
        const PageTakers takers = {[&](uint32_t page, std::span<const std::byte> bytes) {
                                       EXPECT_EQ(bytes.size(), RP_TEXTURE_PAGE_BYTES);
                                       EXPECT_TRUE(tiled.pages.try_emplace(page, bytes.begin(), bytes.end()).second) << page;
                                       return Status();
                                   },
                                   [&](uint32_t page, uint32_t at, std::span<const std::byte> bytes) {
                                       auto& whole = tiled.pages.try_emplace(page, RP_TEXTURE_PAGE_BYTES).first->second;
                                       EXPECT_LE(at + bytes.size(), whole.size());
                                       std::ranges::copy(bytes, whole.begin() + at);
                                       return Status();
                                   }};
        ImageTiler tiler("image", image, std::span(layout->levels).subspan(image.first_level, image.levels), takers);
        const size_t row = size_t{shape.width} * texel_bytes(image.format);
        for (std::span<const std::byte> left = texels; !left.empty();) {
            const auto rows = left.first(std::min(left.size(), rows_at_once == SIZE_MAX ? left.size() : rows_at_once * row));
            EXPECT_TRUE(tiler.take(rows).ok());
            left = left.subspan(rows.size());
        }
        EXPECT_TRUE(tiler.finish().ok());
    }
    EXPECT_EQ(tiled.pages.size(), layout->pages);
    return tiled;
}

std::vector<std::byte> random_texels(const ImageShape& shape, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<std::byte> bytes(uint64_t{shape.width} * shape.height * shape.channels * bytes_of_channel(shape.kind));
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    if (shape.kind == TexelKind::half)
        for (size_t i = 0; i < bytes.size(); i += 2) {
            const uint16_t half = half_of(static_cast<float>(random() % 20000) / 100.0f - (seed % 2 ? 0.0f : 100.0f));
            std::memcpy(bytes.data() + i, &half, 2);
        }
    return bytes;
}

// The bits of x and y by turns, x first; those that are left over behind them.
uint32_t morton_place(uint32_t x, uint32_t y, const TileShape& tile) {
    uint32_t place = 0, bit = 0;
    for (uint32_t i = 0; i < std::max(tile.log_width, tile.log_height); i++) {
        if (i < tile.log_width) place |= (x >> i & 1u) << bit++;
        if (i < tile.log_height) place |= (y >> i & 1u) << bit++;
    }
    return place;
}

std::span<const std::byte> texel_at(const Tiled& tiled, const rp_image& image, const rp_image_level& level, uint32_t x, uint32_t y) {
    const uint32_t bytes = texel_bytes(image.format);
    if (level.at != RP_NONE) return std::span(tiled.pages.at(level.page)).subspan(level.at + (y * level.width + x) * bytes, bytes);
    const TileShape tile = tile_shape(image.format);
    const auto page = static_cast<uint32_t>(level.page + y / tile.height() * tile.across(level.width) + x / tile.width());
    return std::span(tiled.pages.at(page)).subspan(size_t{morton_place(x % tile.width(), y % tile.height(), tile)} * bytes, bytes);
}

// What a channel stands for, in linear light or in steps of the integers, and how far a rounded one may be away.
double value_of(std::span<const std::byte> texel, const ImageShape& shape, uint32_t channel) {
    if (shape.kind == TexelKind::unsigned_8) {
        const auto code = std::to_integer<uint8_t>(texel[channel]);
        return shape.srgb && channel < 3 ? decode_srgb(static_cast<float>(code) / 255) : code;
    }
    uint16_t word;
    std::memcpy(&word, texel.data() + 2 * channel, 2);
    return shape.kind == TexelKind::half ? double{float_of_half(word)} : word;
}

double encoded(double value, const ImageShape& shape, uint32_t channel) {
    if (shape.srgb && channel < 3) return 255 * (value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055);
    return value;
}

double tolerance(double value, const ImageShape& shape) {
    if (shape.kind != TexelKind::half) return 0.5 + 0.02;
    return std::max(std::abs(value), 6e-5) * 0x1p-11 * 1.01 + 1e-4;
}

using Grid = std::vector<double>;  // texels of a level, channels side by side

// The mean over the area of a texel, by how much of each texel before lies in it.
Grid halved(const Grid& before, uint32_t width, uint32_t height, uint32_t channels) {
    const uint32_t m = (width + 1) / 2, k = (height + 1) / 2;
    const auto overlap = [](uint32_t i, uint32_t n, uint32_t of, uint32_t texel) {
        const double low = double(i) * n / of, high = double(i + 1) * n / of;
        return std::max(0.0, std::min(high, texel + 1.0) - std::max(low, double(texel)));
    };
    Grid result(size_t{m} * k * channels);
    for (uint32_t y = 0; y < k; y++)
        for (uint32_t x = 0; x < m; x++) {
            double area = 0;
            for (uint32_t sy = y * height / k; sy < std::min(height, y * height / k + 3); sy++)
                for (uint32_t sx = x * width / m; sx < std::min(width, x * width / m + 3); sx++) {
                    const double weight = overlap(x, width, m, sx) * overlap(y, height, k, sy);
                    area += weight;
                    for (uint32_t c = 0; c < channels; c++)
                        result[(size_t{y} * m + x) * channels + c] += weight * before[(size_t{sy} * width + sx) * channels + c];
                }
            for (uint32_t c = 0; c < channels; c++) result[(size_t{y} * m + x) * channels + c] /= area;
        }
    return result;
}

void expect_levels(const Tiled& tiled, size_t index, const ImageShape& shape, const std::vector<std::byte>& texels) {
    const rp_image& image = tiled.layout.images[index];
    const uint32_t bytes = texel_bytes(image.format);
    Grid model;
    for (size_t at = 0; at < texels.size(); at += bytes)
        for (uint32_t c = 0; c < shape.channels; c++) model.push_back(value_of(std::span(texels).subspan(at, bytes), shape, c));
    uint32_t width = shape.width, height = shape.height;
    for (uint32_t l = 0; l < image.levels; l++) {
        SCOPED_TRACE("level " + std::to_string(l));
        const rp_image_level& level = tiled.layout.levels[image.first_level + l];
        ASSERT_EQ(level.width, width);
        ASSERT_EQ(level.height, height);
        EXPECT_EQ(level.at == RP_NONE, width > RP_IMAGE_TAIL_SIZE || height > RP_IMAGE_TAIL_SIZE);
        for (uint32_t y = 0; y < height; y++)
            for (uint32_t x = 0; x < width; x++)
                for (uint32_t c = 0; c < shape.channels; c++) {
                    const double is = encoded(value_of(texel_at(tiled, image, level, x, y), shape, c), shape, c);
                    const double shall = encoded(model[(size_t{y} * width + x) * shape.channels + c], shape, c);
                    ASSERT_LE(std::abs(is - shall), l == 0 ? 1e-4 : tolerance(shall, shape))
                        << x << ' ' << y << ' ' << c << ": " << is << ' ' << shall;
                }
        model = halved(model, width, height, shape.channels);
        width = (width + 1) / 2;
        height = (height + 1) / 2;
    }
    EXPECT_EQ(width, 1u);
    EXPECT_EQ(height, 1u);
}

TEST(TextureTiler, LevelsAreMeansOfAreas) {
    uint32_t seed = 0;
    for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 2u}, {64u, 64u}, {65u, 1u}, {1u, 300u}, {129u, 67u}, {255u, 257u}, {301u, 130u}})
        for (const ImageShape& shape : support::shapes_of_all_formats(width, height)) {
            SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height) + ", format " + std::to_string(format_of(shape)));
            const auto texels = random_texels(shape, ++seed);
            expect_levels(tile_all({{shape, texels}}), 0, shape, texels);
            if (HasFatalFailure()) return;
        }
}

TEST(TextureTiler, OutsideOfTheImageTheNearestTexelIsRepeated) {
    for (const ImageShape& shape : support::shapes_of_all_formats(300, 70)) {
        const auto texels = random_texels(shape, 5);
        const Tiled tiled = tile_all({{shape, texels}});
        const rp_image& image = tiled.layout.images[0];
        const rp_image_level& level = tiled.layout.levels[0];
        const TileShape tile = tile_shape(image.format);
        for (uint32_t y = 0; y < tile.down(70) * tile.height(); y++)
            for (uint32_t x = 0; x < tile.across(300) * tile.width(); x++) {
                const auto is = texel_at(tiled, image, level, x, y), nearest = texel_at(tiled, image, level, std::min(x, 299u), std::min(y, 69u));
                ASSERT_TRUE(std::ranges::equal(is, nearest)) << x << ' ' << y;
            }
    }
}

TEST(TextureTiler, ItDoesNotMatterHowRowsCome) {
    const ImageShape shape{200, 333, 4, TexelKind::unsigned_8, true};
    const auto texels = random_texels(shape, 9);
    const Tiled all = tile_all({{shape, texels}});
    for (const size_t rows : {1u, 7u, 128u}) EXPECT_EQ(tile_all({{shape, texels}}, rows).pages, all.pages);
}

TEST(TextureTiler, TailsShareAPage) {
    std::vector<std::pair<ImageShape, std::vector<std::byte>>> images;
    for (uint32_t i = 0; i < 40; i++) {
        const ImageShape shape{1 + i * 5 % 80, 1 + i * 7 % 70, i % 3 ? 4u : 1u, i % 2 ? TexelKind::unsigned_8 : TexelKind::half, i % 4 == 1};
        images.emplace_back(shape, random_texels(shape, i));
    }
    const Tiled tiled = tile_all(images);
    EXPECT_LT(tiled.layout.tails.size(), 15u);
    uint32_t tails = 0;
    for (const uint32_t count : tiled.layout.tails) tails += count;
    EXPECT_EQ(tails, images.size());
    for (size_t i = 0; i < images.size(); i++) expect_levels(tiled, i, images[i].first, images[i].second);
}

TEST(TextureTiler, ColoursOfOneKindStayTheSame) {
    for (const ImageShape& shape : support::shapes_of_all_formats(257, 131)) {
        std::vector<std::byte> texels = random_texels(shape, 3);
        const uint32_t bytes = texel_bytes(format_of(shape));
        for (size_t at = bytes; at < texels.size(); at++) texels[at] = texels[at - bytes];
        const Tiled tiled = tile_all({{shape, texels}});
        const rp_image& image = tiled.layout.images[0];
        for (uint32_t l = 0; l < image.levels; l++)
            EXPECT_TRUE(std::ranges::equal(texel_at(tiled, image, tiled.layout.levels[l], 0, 0), std::span(texels).first(bytes))) << l;
    }
}

TEST(TextureTiler, HalvesThatAreNoNumbersBecomeSome) {
    const ImageShape shape{70, 3, 1, TexelKind::half, false};
    std::vector<std::byte> texels(70 * 3 * 2);
    const uint16_t odd[] = {0x7c00, 0xfc00, 0x7e01, 0xffff};
    for (size_t i = 0; i < 4; i++) std::memcpy(texels.data() + 2 * i, &odd[i], 2);
    const Tiled tiled = tile_all({{shape, texels}});
    const float expected[] = {largest_half, -largest_half, 0, 0};
    for (uint32_t i = 0; i < 4; i++)
        EXPECT_EQ(value_of(texel_at(tiled, tiled.layout.images[0], tiled.layout.levels[0], i, 0), shape, 0), expected[i]);
}

TEST(TextureTiler, MissingAndSurplusRowsAreErrors) {
    const ImageShape shape{10, 10, 1, TexelKind::unsigned_8, false};
    const auto layout = lay_out_images(std::span(&shape, 1));
    ASSERT_TRUE(layout.ok());
    const auto make = [&] { return ImageTiler("some.png", layout->images[0], layout->levels, {}); };
    ImageTiler missing = make(), surplus = make();
    ASSERT_TRUE(missing.take(std::vector<std::byte>(90)).ok());
    EXPECT_EQ(missing.finish().message(), "some.png: ended after 9 of 10 rows; it changed while it was read");
    EXPECT_EQ(surplus.take(std::vector<std::byte>(110)).message(), "some.png: has other rows than its size says; it changed while it was read");
    EXPECT_FALSE(make().take(std::vector<std::byte>(7)).ok());
}

TEST(TextureTiler, SrgbIsRoundedToTheNearest) {
    const TexelCodec codec = texel_codec(RP_TEXEL_GRAY8, true);
    for (int i = 0; i <= 1000000; i++) {
        const float linear = static_cast<float>(i) / 1000000;
        std::byte code;
        codec.encode(&linear, 1, &code);
        ASSERT_NEAR(std::to_integer<uint8_t>(code), encoded(linear, {1, 1, 1, TexelKind::unsigned_8, true}, 0), 0.5 + 1e-4) << linear;
    }
    for (int i = 0; i < 256; i++) {
        const auto code = static_cast<std::byte>(i);
        float linear;
        codec.decode(&code, 1, &linear);
        EXPECT_EQ(linear, linear_of_srgb()[static_cast<size_t>(i)]);
        std::byte again;
        codec.encode(&linear, 1, &again);
        EXPECT_EQ(again, code);
    }
}

TEST(TextureTiler, ImpossibleShapesAreRefused) {
    for (const ImageShape& shape : {ImageShape{0, 5, 1, TexelKind::half, false},
                                    {5, RP_IMAGE_MAX_SIZE + 1, 1, TexelKind::half, false},
                                    {5, 5, 3, TexelKind::half, false},
                                    {5, 5, 4, TexelKind::half, true}}) {
        const Status status = check_image_shape(shape, "a.png");
        ASSERT_FALSE(status.ok());
        EXPECT_EQ(status.message().substr(0, 7), "a.png: ");
    }
    const std::vector<ImageShape> many(100, {RP_IMAGE_MAX_SIZE, RP_IMAGE_MAX_SIZE, 4, TexelKind::half, false});
    EXPECT_FALSE(lay_out_images(many).ok());
}

// 65536 texels across: what is in memory is a row of tiles of each level, and little else.
TEST(TextureTiler, MemoryIsThatOfRows) {
    const ImageShape shape{65536, 65536, 4, TexelKind::unsigned_8, true};
    EXPECT_LT(ImageTiler::memory_bytes(shape), uint64_t{80} << 20);
    EXPECT_GT(ImageTiler::memory_bytes(shape), uint64_t{60} << 20);
}

}  // namespace
}  // namespace raypager
