// Lookups of texels on the device (kernels/shading/texture.cl) against a model that knows levels as arrays of texels: the texel of every lookup, and
// the mean of many.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>
#include <set>

#include "base/half.hpp"
#include "raypager/image_source.hpp"
#include "scene/image_levels.hpp"
#include "support/texture_probe.hpp"
#include "support/textured_scene.hpp"

namespace raypager {
namespace {

struct TexelLookup {
    uint32_t image, op;
    float s, t, width;
    uint32_t bits[3];
};

struct FoundTexel {
    uint32_t page, at, words[2];
    float channels[4];
};

using LevelTexel = std::array<uint32_t, 2>;  // as words
using TexelChannels = std::array<double, 4>;

struct ModelLevel {
    uint32_t width, height;
    std::vector<LevelTexel> texels;
    const LevelTexel& at(int64_t x, int64_t y) const { return texels[static_cast<size_t>(y * width + x)]; }
};

LevelTexel texel_words_at(const std::byte* bytes, uint32_t count) {
    LevelTexel words{};
    std::memcpy(words.data(), bytes, count);
    return words;
}

// From pages, by the comment in abi/texture.h alone.
ModelLevel level_in_pages(const support::TextureProbe& probe, const rp_image& image, const rp_image_level& level) {
    constexpr uint32_t bytes_of[] = {1, 2, 2, 4, 8, 8};
    constexpr uint32_t bits_of[][2] = {{8, 8}, {8, 7}, {8, 7}, {7, 7}, {7, 6}, {7, 6}};  // of x and of y within a tile: 64 KiB
    const uint32_t bytes = bytes_of[image.format], *const bits = bits_of[image.format];
    ModelLevel result{level.width, level.height, {}};
    const uint32_t along = (level.width - 1) / (1u << bits[0]) + 1;
    for (uint32_t y = 0; y < level.height; y++)
        for (uint32_t x = 0; x < level.width; x++) {
            uint32_t page = level.page, place = y * level.width + x, at = level.at;
            if (at == RP_NONE) {
                at = place = 0;
                page += y / (1u << bits[1]) * along + x / (1u << bits[0]);
                for (uint32_t k = 0, to = 0; k < bits[0]; k++) {
                    place |= (x >> k & 1u) << to++;
                    if (k < bits[1]) place |= (y >> k & 1u) << to++;
                }
            }
            result.texels.push_back(texel_words_at(probe.page(page).data() + at + size_t{place} * bytes, bytes));
        }
    return result;
}

// Of a scene's images: level 0 as it was given.
std::vector<std::vector<ModelLevel>> model_levels(const Scene& scene, const support::TextureProbe& probe) {
    std::vector<std::vector<ModelLevel>> images;
    for (size_t i = 0; i < scene.images.size(); i++) {
        const rp_image& image = probe.tables().images[i];
        const ImageShape shape = *scene.images[i]->shape();
        ModelLevel given{shape.width, shape.height, {}};
        const uint32_t bytes = shape.channels * static_cast<uint32_t>(bytes_of_channel(shape.kind));
        EXPECT_TRUE(scene.images[i]
                        ->read([&](std::span<const std::byte> rows) {
                            for (size_t at = 0; at < rows.size(); at += bytes) given.texels.push_back(texel_words_at(rows.data() + at, bytes));
                            return Status();
                        })
                        .ok());
        images.emplace_back().push_back(std::move(given));
        for (uint32_t l = 1; l < image.levels; l++)
            images.back().push_back(level_in_pages(probe, image, probe.tables().image_levels[image.first_level + l]));
    }
    return images;
}

double model_channel(uint32_t code, TexelKind kind, bool srgb) {
    if (kind == TexelKind::unsigned_16) return code / 65535.0;
    if (kind == TexelKind::unsigned_8) {
        const double c = code / 255.0;
        return !srgb ? c : c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    }
    const int exponent = static_cast<int>(code >> 10 & 31), mantissa = static_cast<int>(code & 1023);
    const double magnitude = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
    return code & 0x8000 ? -magnitude : magnitude;
}

TexelChannels model_channels(const LevelTexel& texel, const ImageShape& shape) {
    const uint64_t all = texel[0] | uint64_t{texel[1]} << 32;
    const uint32_t bits = shape.kind == TexelKind::unsigned_8 ? 8 : 16;
    TexelChannels c{};
    for (uint32_t k = 0; k < shape.channels; k++)
        c[k] = model_channel(static_cast<uint32_t>(all >> k * bits & ((1u << bits) - 1)), shape.kind, shape.srgb && k < 3);
    if (shape.channels == 1) c = {c[0], c[0], c[0], 1};
    return c;
}

// How an image goes on: -1, it does not.
int64_t wrapped_texel(int64_t i, int64_t n, uint32_t wrap) {
    if (i >= 0 && i < n) return i;
    if (wrap == RP_WRAP_BLACK) return -1;
    if (wrap == RP_WRAP_CLAMP) return i < 0 ? 0 : n - 1;
    if (wrap == RP_WRAP_REPEAT) return (i % n + n) % n;
    const int64_t k = (i % (2 * n) + 2 * n) % (2 * n);
    return k < n ? k : 2 * n - 1 - k;
}

double folded_coordinate(double s, uint32_t wrap) {
    if (wrap == RP_WRAP_REPEAT) return s - std::floor(s);
    if (wrap != RP_WRAP_MIRROR) return s;
    s -= 2 * std::floor(s / 2);
    return s > 1 ? 2 - s : s;
}

bool is_float(double x) { return static_cast<double>(static_cast<float>(x)) == x; }

// floor(s n + u - 1/2), wrapped. Two texels only where floats round on the way, and are within that of a texel's edge.
std::set<int64_t> texels_along(float s, uint32_t n, uint32_t bits, uint32_t wrap) {
    const double u = std::ldexp(bits >> 8, -24), folded = folded_coordinate(s, wrap);
    const bool exact = is_float(folded) && is_float(folded * n) && is_float(folded * n + u - 0.5);
    const double margin = exact ? 0 : std::ldexp(n + 1, -22), at = (wrap == RP_WRAP_MIRROR ? folded : double{s}) * n + u - 0.5;
    std::set<int64_t> texels;
    for (const double x : {at - margin, at + margin}) texels.insert(wrapped_texel(static_cast<int64_t>(std::floor(x)), n, wrap));
    return texels;
}

constexpr double log_error = 0.0095;  // of rp_log2_near

// floor(log2(texels that the footprint is wide) + u).
std::set<uint32_t> levels_for(const TexelLookup& l, uint32_t most, uint32_t count) {
    const double wide = double{l.width} * most, u = std::ldexp(l.bits[2] >> 8, -24);
    if (!(wide > 0)) return {0};
    const double log = std::log2(wide), margin = std::abs(log - std::rint(log)) < 1e-6 ? 1e-5 : log_error;
    std::set<uint32_t> levels;
    for (const double x : {log - margin, log + margin}) {
        const double level = std::floor(std::min(x, 100.0) + u);
        levels.insert(static_cast<uint32_t>(std::min(std::max(level, 0.0), count - 1.0)));
    }
    return levels;
}

class LookupMaker {
public:
    explicit LookupMaker(uint32_t seed) : random_(seed) {}

    float coordinate(uint32_t n) {
        const uint32_t kind = random_() % 8;
        const auto texel = static_cast<float>(static_cast<int>(random_() % (4 * n + 1)) - static_cast<int>(2 * n));
        if (kind == 0) return texel / static_cast<float>(n);                       // between texels
        if (kind == 1) return (texel + 0.5f) / static_cast<float>(n);              // in their middles
        if (kind == 2) return static_cast<float>(random_() % 257) / 64.0f - 2.0f;  // exact
        if (kind == 3) return between(-1e6f, 1e6f);
        if (kind == 4) return std::array{0.0f, -0.0f, 1.0f, -1.0f, 2.0f, -1e-9f, 1e-9f, 1.0f - 0x1p-24f}[random_() % 8];
        return between(-2, 3);
    }
    uint32_t number() {
        const uint32_t kind = random_() % 8;
        return kind == 0 ? std::array{0u, ~0u, 0x80000000u, 0x7fffffffu}[random_() % 4] : static_cast<uint32_t>(random_());
    }
    TexelLookup lookup(uint32_t image, const rp_image_level& whole, uint32_t levels, uint32_t wrap) {
        const auto most = static_cast<float>(std::max(whole.width, whole.height));
        const int level = static_cast<int>(random_() % (levels + 2)) - 1;
        const float width = std::ldexp(random_() % 2 ? 1.0f : between(1, 2), level) / most;
        return {image,
                RP_TEXTURE_IMAGE | wrap << RP_TEXTURE_WRAP_SHIFT,
                coordinate(whole.width),
                coordinate(whole.height),
                width,
                {number(), number(), number()}};
    }

private:
    float between(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_); }
    std::mt19937 random_;
};

// Compares lookups with the model, and counts what was met.
class LookupComparison {
public:
    LookupComparison(const Scene& scene, const support::TextureProbe& probe) : probe_(probe), model_(model_levels(scene, probe)) {
        for (const auto& source : scene.images) shapes_.push_back(*source->shape());
    }
    // False where the texel is none of those that it may be.
    bool compare(const TexelLookup& l, const FoundTexel& found) {
        const auto& levels = model_[l.image];
        const uint32_t wrap = l.op >> RP_TEXTURE_WRAP_SHIFT;
        const ImageShape& shape = shapes_[l.image];
        uint32_t choices = 0;
        bool met = false;
        for (const uint32_t number : levels_for(l, std::max(shape.width, shape.height), static_cast<uint32_t>(levels.size()))) {
            const ModelLevel& level = levels[number];
            for (const int64_t x : texels_along(l.s, level.width, l.bits[0], wrap & 3))
                for (const int64_t y : texels_along(l.t, level.height, l.bits[1], wrap >> 2 & 3)) {
                    choices++;
                    const bool black = x < 0 || y < 0;
                    const LevelTexel texel = black ? LevelTexel{} : level.at(x, y);
                    if (texel[0] != found.words[0] || texel[1] != found.words[1] || black != (found.page == RP_NONE)) continue;
                    met = true;
                    if (black) continue;
                    seen_levels_.insert({l.image, number});
                    expect_channels(texel, shape, found);
                }
        }
        doubtful_ += choices > 1;
        return met;
    }
    size_t doubtful() const { return doubtful_; }
    // Whether lookups have come to all levels of all images.
    void expect_all_levels() const {
        for (uint32_t i = 0; i < model_.size(); i++)
            for (uint32_t l = 0; l < model_[i].size(); l++) EXPECT_TRUE(seen_levels_.contains({i, l})) << i << ' ' << l;
    }

private:
    void expect_channels(const LevelTexel& texel, const ImageShape& shape, const FoundTexel& found) const {
        const TexelChannels c = model_channels(texel, shape);
        for (size_t k = 0; k < 4; k++) ASSERT_NEAR(found.channels[k], c[k], 3e-7 * std::abs(c[k]) + 1e-12) << format_of(shape) << ' ' << k;
    }

    const support::TextureProbe& probe_;
    std::vector<ImageShape> shapes_;
    std::vector<std::vector<ModelLevel>> model_;
    std::set<std::pair<uint32_t, uint32_t>> seen_levels_;
    size_t doubtful_ = 0;
};

// All formats, sizes that fill no tile, levels in tiles of several rows and in tails, all pairs of wraps.
TEST(TexturesOnDevice, EachLookupIsTheTexelOfTheModel) {
    Scene scene;
    for (const auto& [width, height] : {std::pair{1u, 1u}, {1u, 100u}, {3u, 5u}, {64u, 64u}, {65u, 64u}, {300u, 200u}, {129u, 257u}, {270u, 300u}})
        for (const ImageShape& shape : support::shapes_of_all_formats(width, height))
            scene.images.push_back(support::random_image(shape, static_cast<uint32_t>(scene.images.size())));
    support::TextureProbe probe(scene);
    LookupMaker maker(21);
    std::vector<TexelLookup> lookups;
    for (uint32_t i = 0; i < scene.images.size(); i++) {
        const rp_image& image = probe.tables().images[i];
        for (uint32_t k = 0; k < 3200; k++) lookups.push_back(maker.lookup(i, probe.tables().image_levels[image.first_level], image.levels, k % 16));
    }
    const auto found = probe.run<FoundTexel>("rp_probe_texels", lookups, lookups.size());
    LookupComparison comparison(scene, probe);
    size_t wrong = 0;
    for (size_t i = 0; i < lookups.size(); i++) {
        const TexelLookup& l = lookups[i];
        if (comparison.compare(l, found[i]) || ++wrong > 5) continue;
        const ImageShape shape = *scene.images[l.image]->shape();
        ADD_FAILURE() << shape.width << " x " << shape.height << ", format " << format_of(shape) << ", at " << l.s << ' ' << l.t << ", width "
                      << l.width << ", wraps " << (l.op >> RP_TEXTURE_WRAP_SHIFT) << ", numbers " << l.bits[0] << ' ' << l.bits[1] << ' ' << l.bits[2]
                      << ": page " << found[i].page << ", byte " << found[i].at;
    }
    EXPECT_EQ(wrong, 0u) << "of " << lookups.size();
    EXPECT_LT(comparison.doubtful(), lookups.size() / 20);
    comparison.expect_all_levels();
}

// Whatever a map makes of damaged coordinates: nothing outside of the image is read.
TEST(TexturesOnDevice, CoordinatesThatAreNoNumbersComeToSomeTexel) {
    Scene scene;
    scene.images = {support::random_image({300, 200, 4, TexelKind::unsigned_8, true}, 1),
                    support::random_image({3, 5, 1, TexelKind::half, false}, 2)};
    support::TextureProbe probe(scene);
    constexpr float infinite = std::numeric_limits<float>::infinity(), none = std::numeric_limits<float>::quiet_NaN();
    const float odd[] = {infinite, -infinite, none, 3e38f, -3e38f, 1e-45f, 0.0f, -1.0f};
    std::vector<TexelLookup> lookups;
    for (const uint32_t image : {0u, 1u})
        for (uint32_t wraps = 0; wraps < 16; wraps++)
            for (const float s : odd)
                for (const float t : odd)
                    for (const float width : odd)
                        lookups.push_back({image, wraps << RP_TEXTURE_WRAP_SHIFT, s, t, width, {0x12345678, 0xffffffff, 0x87654321}});
    const auto found = probe.run<FoundTexel>("rp_probe_texels", lookups, lookups.size());
    const rp_image_level& small = probe.tables().image_levels[probe.tables().images[1].first_level];
    for (size_t i = 0; i < found.size(); i++) {
        if (found[i].page == RP_NONE) continue;
        const bool is_small = lookups[i].image == 1;
        ASSERT_LT(found[i].page, probe.page_count());
        ASSERT_LE(found[i].at + (is_small ? 2 : 4), RP_TEXTURE_PAGE_BYTES);
        if (is_small) {
            ASSERT_TRUE(found[i].page == small.page && found[i].at >= small.at && found[i].at < small.at + 100) << found[i].at;
        }
    }
}

struct MeanLookup {
    uint32_t image, op;
    float s, t, width;
    uint32_t samples, unused[2] = {};
};

std::shared_ptr<const ImageSource> smooth_image(const ImageShape& shape) {
    std::vector<std::byte> texels;
    for (uint32_t y = 0; y < shape.height; y++)
        for (uint32_t x = 0; x < shape.width; x++)
            for (uint32_t c = 0; c < shape.channels; c++) {
                const double u = (x + 0.5) / shape.width, v = (y + 0.5) / shape.height;
                const double value = 0.5 + 0.2 * std::sin(7 * u + c) + 0.2 * std::cos(9 * v - 4 * u * c);
                uint16_t code = half_of(static_cast<float>(value));
                if (shape.kind == TexelKind::unsigned_8) code = static_cast<uint16_t>(std::lround(255 * value));
                if (shape.kind == TexelKind::unsigned_16) code = static_cast<uint16_t>(std::lround(65535 * value));
                const auto bytes = std::as_bytes(std::span(&code, 1)).first(bytes_of_channel(shape.kind));
                texels.insert(texels.end(), bytes.begin(), bytes.end());
            }
    return memory_image("smooth", shape, std::move(texels));
}

// Bilinear between the middles of texels; range: of the texels between which it is.
TexelChannels bilinear(const ModelLevel& level, const ImageShape& shape, const MeanLookup& l, std::array<std::pair<double, double>, 4>& range) {
    const uint32_t wrap = l.op >> RP_TEXTURE_WRAP_SHIFT;
    const double x = double{l.s} * level.width - 0.5, y = double{l.t} * level.height - 0.5, fx = x - std::floor(x), fy = y - std::floor(y);
    TexelChannels sum{};
    for (int i = 0; i < 4; i++) {
        const int64_t column = wrapped_texel(static_cast<int64_t>(std::floor(x)) + (i & 1), level.width, wrap & 3);
        const int64_t row = wrapped_texel(static_cast<int64_t>(std::floor(y)) + (i >> 1), level.height, wrap >> 2 & 3);
        const TexelChannels c = column < 0 || row < 0 ? model_channels({}, shape) : model_channels(level.at(column, row), shape);
        const double weight = (i & 1 ? fx : 1 - fx) * (i >> 1 ? fy : 1 - fy);
        for (size_t k = 0; k < 4; k++) {
            sum[k] += weight * c[k];
            range[k] = {std::min(range[k].first, c[k]), std::max(range[k].second, c[k])};
        }
    }
    return sum;
}

// Linear between the levels of a trilinear filter. OpenImageIO's own levels are of other areas where sizes are odd, so it is no judge of these.
TEST(TexturesOnDevice, TheMeanOfLookupsIsATrilinearFilter) {
    constexpr uint32_t samples = 4096;
    Scene scene;
    for (const auto& [width, height] : {std::pair{5u, 3u}, {129u, 67u}, {300u, 200u}})
        for (const ImageShape& shape : support::shapes_of_all_formats(width, height)) scene.images.push_back(smooth_image(shape));
    support::TextureProbe probe(scene);
    const auto model = model_levels(scene, probe);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> place(-1, 2), logarithm(-9, 1);
    std::vector<MeanLookup> lookups;
    for (uint32_t i = 0; i < 480; i++)
        lookups.push_back({i % static_cast<uint32_t>(scene.images.size()), static_cast<uint32_t>(random() % 16) << RP_TEXTURE_WRAP_SHIFT,
                           place(random), place(random), std::exp2(logarithm(random)), samples});
    const auto means = probe.run<std::array<float, 4>>("rp_probe_means", lookups, lookups.size());
    double worst = 0, most_off = 0;
    for (size_t i = 0; i < lookups.size(); i++) {
        const MeanLookup& l = lookups[i];
        const ImageShape shape = *scene.images[l.image]->shape();
        const auto& levels = model[l.image];
        const double level = std::min(std::max(std::log2(double{l.width} * std::max(shape.width, shape.height)), 0.0), levels.size() - 1.0);
        const auto finer = static_cast<size_t>(level);
        const double share = level - static_cast<double>(finer);
        std::array<std::pair<double, double>, 4> range;
        range.fill({1, 0});
        const TexelChannels a = bilinear(levels[finer], shape, l, range),
                            b = bilinear(levels[std::min(finer + 1, levels.size() - 1)], shape, l, range);
        for (size_t k = 0; k < 4; k++) {
            const double expected = a[k] + share * (b[k] - a[k]), off = std::abs(means[i][k] - expected);
            const double spread = range[k].second - range[k].first,
                         bound = log_error * std::abs(b[k] - a[k]) + 0.01 * spread + 5e-5;  // the last: of a sum of floats
            EXPECT_LE(off, bound) << "image " << l.image << " at " << l.s << ' ' << l.t << ", width " << l.width << ", wraps "
                                  << (l.op >> RP_TEXTURE_WRAP_SHIFT) << ", channel " << k << ": " << means[i][k] << ' ' << expected;
            if (spread > 1e-3) worst = std::max(worst, (off - log_error * std::abs(b[k] - a[k])) / spread);
            most_off = std::max(most_off, off);
        }
    }
    std::printf("off by %.4f of the texels' spread at most, by %.4f in all\n", worst, most_off);
}

}  // namespace
}  // namespace raypager
