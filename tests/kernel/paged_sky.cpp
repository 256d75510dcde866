// Skies in pages on the device (kernels/shading/paged_sky.cl): the texel of every lookup against the image, the mean of many against what lies
// between texels, and directions that come as often as their level shines.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "raypager/bake.hpp"
#include "raypager/sky.hpp"
#include "reference/light_images.hpp"
#include "store/block_source.hpp"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"
#include "texture/texture_words.hpp"

namespace raypager {
namespace {

struct SkyLookup {
    float x, y;
    uint32_t level, samples, bits[2], unused[2] = {};
};
using SkyMean = std::array<uint32_t, 4>;
using SkyColor = std::array<float, 4>;

constexpr uint32_t sky_size = 300, first_sky_page = 3;

// Up to beyond what halves hold.
Image bright_image() {
    std::mt19937 random(3);
    Image image{sky_size, sky_size, 3, {}};
    for (uint32_t i = 0; i < 3 * sky_size * sky_size; i++) {
        const auto magnitude = static_cast<int>(random() % 8);
        image.values.push_back(std::ldexp(1.0f + static_cast<float>(random() % 1000) / 1000, i / 3 % 997 == 0 ? 20 : magnitude - 4));
    }
    return image;
}

class PagedSkyOnDevice : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
        Scene scene;
        scene.materials.resize(1);
        ASSERT_TRUE(set_sky(scene, bright_image()).ok());
        image_ = scene.light_images[0];
        BakeOptions options;
        options.resident_sky_bytes = 8 * sky_size * sky_size - 1;
        options.scattered_sky_size = 80;
        auto baked = bake(scene, options);
        ASSERT_TRUE(baked.ok()) << baked.status().message();
        const BlockSource& source = baked->blocks.source();
        baked_ = source.scene();
        ASSERT_TRUE(baked_.has_paged_sky());
        std::vector<std::byte> slab(baked_.pages.size() * RP_TEXTURE_PAGE_BYTES);
        for (uint32_t page = 0; page < baked_.pages.size(); page++)
            ASSERT_TRUE(source.read_page(page, std::span(slab).subspan(size_t{page} * RP_TEXTURE_PAGE_BYTES, RP_TEXTURE_PAGE_BYTES)).ok());
        slab_ = buffer(slab);
        const TextureWords words = texture_words(baked_);
        words_ = buffer(bytes_of(words.words));
        const rp_texture_tables at = {first_sky_page, words.images_at, words.levels_at, words.ops_at, words.maps_at, 0, 0, 0};
        at_ = buffer(std::as_bytes(std::span(&at, 1)));
        sky_ = buffer(bytes_of(baked_.sky_words));
        set_absent(RP_NONE);
    }

    void set_absent(uint32_t absent) {
        std::vector<rp_page> table(first_sky_page, {RP_NONE, 0, 0, 0});
        for (uint32_t page = 0; page < baked_.pages.size(); page++)
            table.push_back({page == absent ? RP_NONE : page * RP_TEXTURE_PAGE_BYTES / RP_BLOCK_ALIGNMENT, 0, 0, 0});
        table_ = buffer(bytes_of(table));
    }

    template <class Item>
    std::vector<SkyColor> run(const char* name, const std::vector<Item>& items) {
        auto kernel = support::probe_kernel(*device_, "shading/sky_probe", name,
                                            "-DRP_SLABS=1 -DRP_SHORT_STATES -DRP_TEXTURES -DRP_SKY -DRP_SKY_PAGED -DRP_STACK_SIZE=96");
        if (!kernel.ok()) throw std::runtime_error(kernel.status().message());
        std::vector<SkyColor> results(items.size());
        const Buffer in = buffer(bytes_of(items)), out = buffer(bytes_of(results));
        const auto count = static_cast<uint32_t>(items.size());
        const bool done = kernel->set(table_, slab_, words_, at_, sky_, in, count, out).ok() && device_->kernels().launch(*kernel, count, 1).ok() &&
                          device_->kernels().read_now(out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    Buffer buffer(std::span<const std::byte> contents) {
        auto result = device_->upload(contents, "a test");
        if (!result.ok()) throw std::runtime_error(result.status().message());
        return std::move(*result);
    }

    // Each texel of a level is the mean of what it covers of the one before it; sizes are even.
    LightImage level(uint32_t number) const {
        LightImage level = *image_;
        for (uint32_t i = 0; i < number; i++) {
            const LightImage before = level;
            level = {before.width / 2, before.height / 2, {}};
            for (uint32_t y = 0; y < level.height; y++)
                for (uint32_t x = 0; x < level.width; x++) {
                    Float3 sum{};
                    for (const uint32_t at : {0u, 1u, before.width, before.width + 1}) {
                        const Float3 c = texel_color(before.texels[size_t{2} * y * before.width + 2 * x + at]);
                        sum = {sum.x + c.x / 4, sum.y + c.y / 4, sum.z + c.z / 4};
                    }
                    level.texels.push_back(texel_of(sum));
                }
        }
        return level;
    }

    std::unique_ptr<Device> device_;
    std::shared_ptr<const LightImage> image_;
    BakedScene baked_;
    Buffer table_, slab_, words_, at_, sky_;
};

// Beyond an edge lies what is on its other half.
Float3 folded_color(const LightImage& image, int64_t x, int64_t y) {
    const int64_t n = image.width;
    if (x < 0 || x >= n) return folded_color(image, x < 0 ? 0 : n - 1, n - 1 - y);
    if (y < 0 || y >= n) return folded_color(image, n - 1 - x, y < 0 ? 0 : n - 1);
    return texel_color(image.texels[static_cast<size_t>(y * n + x)]);
}

TEST_F(PagedSkyOnDevice, ImageAndTableAreWhereTheyBelong) {
    EXPECT_EQ(baked_.sky_words[RP_IMAGE_LEVEL], 2u);
    EXPECT_EQ(baked_.sky_words[RP_IMAGE_CELLS], 75u);
    EXPECT_EQ(baked_.images.size(), 1u);
    EXPECT_TRUE(baked_.light_images[0]->texels.empty());
    EXPECT_GT(baked_.pages.size(), 15u);
}

TEST_F(PagedSkyOnDevice, EveryLookupFindsItsTexel) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> share(0, 1);
    std::vector<SkyLookup> items;
    for (uint32_t i = 0; i < 6000; i++) {
        // Every third close to an edge.
        const auto place = [&] { return i % 3 == 0 ? std::round(share(random)) : share(random); };
        items.push_back({place(), place(), i % 3, 0, {static_cast<uint32_t>(random()), static_cast<uint32_t>(random())}});
    }
    const auto results = run("rp_probe_sky_texels", items);
    const LightImage levels[] = {level(0), level(1), level(2)};
    for (size_t i = 0; i < items.size(); i++) {
        const SkyLookup& item = items[i];
        const LightImage& image = levels[item.level];
        const auto along = [&](float at, uint32_t bits) {
            const float offset = static_cast<float>(bits >> 8) * 0x1p-24f - 0.5f;
            return static_cast<int64_t>(std::floor(at * static_cast<float>(image.width) + offset));
        };
        const Float3 expected = folded_color(image, along(item.x, item.bits[0]), along(item.y, item.bits[1]));
        const float tolerance = item.level == 0 ? 0 : 1e-4f * std::max({expected.x, expected.y, expected.z});
        EXPECT_NEAR(results[i][0], expected.x, tolerance) << i;
        EXPECT_NEAR(results[i][1], expected.y, tolerance) << i;
        EXPECT_NEAR(results[i][2], expected.z, tolerance) << i;
        EXPECT_EQ(std::bit_cast<uint32_t>(results[i][3]), RP_NONE);
    }
}

TEST_F(PagedSkyOnDevice, TheMeanOfLookupsIsWhatLiesBetweenTexels) {
    constexpr uint32_t samples = 1 << 14;
    std::mt19937 random(6);
    std::normal_distribution<double> along;
    std::vector<SkyMean> items;
    std::vector<reference::Vec3> expected;
    std::vector<float> brightest;  // of the four texels around a place
    for (uint32_t i = 0; i < 300; i++) {
        const double x = along(random), y = along(random), z = i % 4 == 0 ? -1e-3 : along(random), size = std::hypot(x, y, z);
        const auto place = sky_place({x, y, z});
        items.push_back({std::bit_cast<uint32_t>(static_cast<float>(place[0])), std::bit_cast<uint32_t>(static_cast<float>(place[1])), 0, samples});
        expected.push_back(reference::color_in_direction(*image_, {x / size, y / size, z / size}));
        const auto left = static_cast<int64_t>(std::floor(place[0] * sky_size - 0.5)),
                   top = static_cast<int64_t>(std::floor(place[1] * sky_size - 0.5));
        float& most = brightest.emplace_back(0);
        for (const auto& [column, row] : {std::pair(left, top), {left + 1, top}, {left, top + 1}, {left + 1, top + 1}}) {
            const Float3 c = folded_color(*image_, column, row);
            most = std::max({most, c.x, c.y, c.z});
        }
    }
    const auto results = run("rp_probe_sky_means", items);
    // So many numbers lie so evenly that shares of texels are right to a thousandth.
    for (size_t i = 0; i < items.size(); i++)
        for (int c = 0; c < 3; c++) EXPECT_NEAR(results[i][static_cast<size_t>(c)], expected[i][c], 1e-3 * brightest[i]) << i;
}

TEST_F(PagedSkyOnDevice, DirectionsComeAsOftenAsTheirLevelShines) {
    std::mt19937 random(7);
    std::vector<std::array<uint32_t, 4>> numbers(1 << 16);
    for (auto& four : numbers)
        for (uint32_t& n : four) n = static_cast<uint32_t>(random());
    double sums[3] = {};
    for (const SkyColor& share : run("rp_probe_sky_shares", numbers))
        for (size_t c = 0; c < 3; c++) sums[c] += share[c] / static_cast<double>(numbers.size()) / (4 * std::numbers::pi);
    const Float3 mean = mean_color(*image_);
    EXPECT_NEAR(sums[0], mean.x, 0.02 * mean.x);
    EXPECT_NEAR(sums[1], mean.y, 0.02 * mean.y);
    EXPECT_NEAR(sums[2], mean.z, 0.02 * mean.z);
}

TEST_F(PagedSkyOnDevice, APageThatIsAbsentIsNamed) {
    const SkyLookup somewhere = {0.4f, 0.7f, 0, 0, {1u << 31, 1u << 31}};
    const rp_image_level& whole = baked_.image_levels[0];
    // Tiles are 128 x 64 texels, row by row.
    const uint32_t page = whole.page + 210 / 64 * 3 + 120 / 128;
    set_absent(page);
    EXPECT_EQ(std::bit_cast<uint32_t>(run("rp_probe_sky_texels", std::vector{somewhere})[0][3]), first_sky_page + page);
    set_absent(page + 1);
    EXPECT_EQ(std::bit_cast<uint32_t>(run("rp_probe_sky_texels", std::vector{somewhere})[0][3]), RP_NONE);
}

}  // namespace
}  // namespace raypager
