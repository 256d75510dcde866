// Skies on the device (kernels/shading/sky.cl): directions come as often as their density says, densities are in proportion to what shines, and
// directions are where pbrt has them.
#include "raypager/sky.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "lights/image_words.hpp"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

struct SkySample {
    float direction[3], density, radiance[3], found_density, found_radiance[3], unused;
};

class SkyOnDevice : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
    }

    // value: of a pixel, grey.
    template <class Value>
    void upload(uint32_t size, const Value& value) {
        image_ = {size, size, 1, {}};
        for (uint32_t y = 0; y < size; y++)
            for (uint32_t x = 0; x < size; x++) image_.values.push_back(static_cast<float>(value(x, y)));
        Scene scene;
        ASSERT_TRUE(set_sky(scene, image_).ok());
        std::vector<uint32_t> words;
        ASSERT_TRUE(for_image_words(scene.light_images, scene.lights, 0, [&](std::span<const uint32_t> head, std::span<const rp_texel> texels) {
                        words.assign(head.begin(), head.end());
                        for (const rp_texel& t : texels) words.insert(words.end(), {t.red_green, t.blue_exponent});
                        return Status();
                    }).ok());
        EXPECT_EQ(words.size() * sizeof(uint32_t), image_words_bytes(scene.light_images, scene.lights));
        auto buffer = device_->upload(bytes_of(words), "a sky");
        ASSERT_TRUE(buffer.ok());
        sky_ = std::move(*buffer);
    }

    template <class Result, class Item>
    std::vector<Result> run(const char* name, const std::vector<Item>& items) {
        auto kernel = support::probe_kernel(*device_, "single_ray/probe", name, "-DRP_SLABS=1 -DRP_STACK_SIZE=96 -DRP_SKY");
        if (!kernel.ok()) throw std::runtime_error(kernel.status().message());
        std::vector<Result> results(items.size());
        auto in = device_->upload(bytes_of(items), "items"), out = device_->allocate(results.size() * sizeof(Result), "results");
        const auto count = static_cast<uint32_t>(items.size());
        const bool done = in.ok() && out.ok() && kernel->set(sky_, *in, count, *out).ok() && device_->kernels().launch(*kernel, count, 1).ok() &&
                          device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    std::vector<SkySample> samples(uint32_t count, uint32_t seed) {
        std::mt19937 random(seed);
        std::vector<std::array<uint32_t, 4>> numbers(count);
        for (auto& four : numbers)
            for (uint32_t& n : four) n = static_cast<uint32_t>(random());
        return run<SkySample>("rp_probe_sky", numbers);
    }

    std::unique_ptr<Device> device_;
    Image image_;
    Buffer sky_;
};

double spotted(uint32_t x, uint32_t y) { return x == 7 && y == 20 ? 500 : y < 3 ? 0 : 0.2 + 0.1 * ((x * 7 + y * 3) % 11); }

// Chi-square over a grid of places that has nothing to do with the cells of the table.
TEST_F(SkyOnDevice, directions_come_as_often_as_their_density_says) {
    constexpr uint32_t count = 1 << 16, parts = 12, fine = 40;
    upload(37, spotted);
    std::vector<double> met(parts * parts), expected(parts * parts);
    for (const SkySample& s : samples(count, 3)) {
        const auto place = sky_place({s.direction[0], s.direction[1], s.direction[2]});
        met[std::min(parts - 1, static_cast<uint32_t>(place[1] * parts)) * parts + std::min(parts - 1, static_cast<uint32_t>(place[0] * parts))]++;
    }
    std::vector<std::array<float, 4>> directions;
    for (uint32_t y = 0; y < parts * fine; y++)
        for (uint32_t x = 0; x < parts * fine; x++) {
            const auto d = sky_direction((x + 0.5) / (parts * fine), (y + 0.5) / (parts * fine));
            directions.push_back({static_cast<float>(d[0]), static_cast<float>(d[1]), static_cast<float>(d[2]), 0});
        }
    const auto densities = run<std::array<float, 4>>("rp_probe_sky_directions", directions);
    double all = 0;
    for (uint32_t y = 0; y < parts * fine; y++)
        for (uint32_t x = 0; x < parts * fine; x++) {
            const double share = densities[y * parts * fine + x][0] * 4 * pi / (double{parts} * fine * parts * fine);
            expected[y / fine * parts + x / fine] += count * share;
            all += share;
        }
    EXPECT_NEAR(all, 1, 0.01);  // the spot's edge falls between places that were looked at
    double chi = 0, freedom = 0;
    for (size_t i = 0; i < met.size(); i++) {
        if (expected[i] < 8) continue;
        // What the sums above leave of the spot's edge, besides chance.
        const double uncertain = expected[i] + std::pow(0.01 * expected[i], 2);
        chi += std::pow(met[i] - expected[i], 2) / uncertain;
        freedom++;
    }
    EXPECT_GT(freedom, 100);
    EXPECT_LT(chi, freedom + 5 * std::sqrt(2 * freedom));
}

// Without the sky in the table, this is what tells a wrong density from a right one: each sample's radiance over its density has the mean that the
// image has.
TEST_F(SkyOnDevice, samples_estimate_what_the_image_sheds) {
    for (const uint32_t size : {1u, 2u, 37u, 300u}) {
        SCOPED_TRACE(size);
        upload(size, [&](uint32_t x, uint32_t y) { return size < 10 ? 1.0 + x + y : spotted(x, y); });
        double mean = 0, sum = 0, squares = 0;
        for (const float v : image_.values) mean += v / static_cast<double>(image_.values.size());
        constexpr uint32_t count = 1 << 15;
        for (const SkySample& s : samples(count, 4)) {
            const double estimate = s.radiance[0] / s.density / (4 * pi);
            sum += estimate;
            squares += estimate * estimate;
            EXPECT_NEAR(std::hypot(s.direction[0], s.direction[1], s.direction[2]), 1, 1e-6);
        }
        const double average = sum / count, deviation = std::sqrt(std::max(0.0, squares / count - average * average));
        EXPECT_NEAR(average, mean, 4 * deviation / std::sqrt(count) + 1e-4 * mean);
        EXPECT_LT(deviation, 0.8 * mean);  // cells are as bright as what is in them, on average
    }
}

TEST_F(SkyOnDevice, what_is_drawn_is_found_again) {
    upload(64, spotted);
    uint32_t others = 0;
    for (const SkySample& s : samples(1 << 14, 5)) {
        others += s.found_density != s.density;
        const double brightest = 500;
        EXPECT_NEAR(s.found_radiance[0], s.radiance[0], 1e-3 * brightest * 64 * 1e-3 + 1e-3 * s.radiance[0]);
    }
    EXPECT_LT(others, 8u);  // within rounding of the edge between cells
}

TEST_F(SkyOnDevice, radiance_is_that_of_the_image) {
    upload(37, spotted);
    std::mt19937 random(6);
    std::normal_distribution<double> along;
    std::vector<std::array<float, 4>> directions = {{1, 0, 0, 0}, {-1, 0, 0, 0}, {0, 1, 0, 0}, {0, -1, 0, 0}, {0, 0, 1, 0}, {0, 0, -1, 0}};
    for (int i = 0; i < 2000; i++) {
        const double x = along(random), y = along(random), z = along(random), size = std::hypot(x, y, z);
        directions.push_back({static_cast<float>(x / size), static_cast<float>(y / size), static_cast<float>(z / size), 0});
    }
    const auto results = run<std::array<float, 4>>("rp_probe_sky_directions", directions);
    for (size_t i = 0; i < directions.size(); i++) {
        const auto& d = directions[i];
        const Float3 expected = sky_color(image_, {d[0], d[1], d[2]});
        EXPECT_NEAR(results[i][1], expected.x, 1e-4 * expected.x + 2e-2) << d[0] << " " << d[1] << " " << d[2];
        if (expected.x > 0) {
            EXPECT_GT(results[i][0], 0);
        }
    }
}

TEST_F(SkyOnDevice, a_black_sky_is_drawn_from_evenly) {
    upload(5, [](uint32_t, uint32_t) { return 0.0; });
    for (const SkySample& s : samples(1000, 7)) {
        EXPECT_NEAR(s.density, 1 / (4 * pi), 1e-6);
        EXPECT_EQ(s.radiance[0], 0);
    }
}

}  // namespace
}  // namespace raypager
