// The choice among lights by a tree (kernels/shading/light_tree.cl): a distribution at every place, which leaves out no light that shines there and
// favours those that give much; the probability at a hit is that of the choice.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <vector>

#include "lights/light_choice.hpp"
#include "support/device_scene.hpp"
#include "support/many_lights.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

using Float4 = std::array<float, 4>;

class LightTreeChoice : public testing::Test {
protected:
    struct Chosen {
        uint32_t light;
        float rest, chance, by_way;
    };

    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
    }

    void upload(std::vector<rp_light> lights) {
        ASSERT_TRUE(has_light_tree(lights));
        const std::vector<uint32_t> words = light_choice(lights);
        EXPECT_EQ(words.size() * sizeof(uint32_t), light_choice_bytes(lights));
        auto tree = device_->upload(bytes_of(words), "tree"), list = device_->upload(bytes_of(lights), "lights");
        ASSERT_TRUE(tree.ok() && list.ok());
        tree_ = std::move(*tree);
        list_ = std::move(*list);
        lights_ = std::move(lights);
    }

    std::vector<Chosen> choose(const std::vector<Float4>& places, const std::vector<std::array<uint32_t, 2>>& numbers) {
        auto kernel = get("rp_probe_light_tree");
        std::vector<Chosen> results(places.size());
        auto at = device_->upload(bytes_of(places), "places"), by = device_->upload(bytes_of(numbers), "numbers");
        auto out = device_->allocate(results.size() * sizeof(Chosen), "results");
        const auto count = static_cast<uint32_t>(places.size());
        const bool done = at.ok() && by.ok() && out.ok() && kernel.set(tree_, list_, *at, *by, count, *out).ok() &&
                          device_->kernels().launch(kernel, count, 1).ok() &&
                          device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    // Of all lights that have a place, those of the first place first.
    std::vector<float> chances(const std::vector<Float4>& places) {
        auto kernel = get("rp_probe_light_chances");
        std::vector<float> results(places.size() * lights_.size());
        auto at = device_->upload(bytes_of(places), "places"), out = device_->allocate(results.size() * sizeof(float), "results");
        const auto count = static_cast<uint32_t>(results.size());
        const bool done = at.ok() && out.ok() && kernel.set(tree_, list_, static_cast<uint32_t>(lights_.size()), *at, count, *out).ok() &&
                          device_->kernels().launch(kernel, count, 1).ok() &&
                          device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    Kernel get(const char* name) {
        auto kernel = support::probe_kernel(*device_, "single_ray/probe", name, "-DRP_SLABS=1 -DRP_STACK_SIZE=96 -DRP_LIGHT_TREE -DRP_LIGHT_CLOSE");
        if (!kernel.ok()) throw std::runtime_error(kernel.status().message());
        return std::move(*kernel);
    }

    bool has_place(size_t i) const { return lights_[i].kind != RP_LIGHT_INFINITE && lights_[i].kind != RP_LIGHT_DISTANT; }

    // Far from the lights, among them, and on them.
    std::vector<Float4> some_places(std::mt19937& random, uint32_t count) const {
        std::vector<Float4> places;
        for (uint32_t i = 0; i < count; i++) {
            const Float3 p = support::random_place(random, i % 4 == 0 ? 1000.0f : 12.0f);
            places.push_back({p.x, p.y, p.z, 0});
            if (i % 4 == 3) std::copy_n(lights_[random() % lights_.size()].p, 3, places.back().begin());
        }
        return places;
    }

    std::unique_ptr<Device> device_;
    Buffer tree_, list_;
    std::vector<rp_light> lights_;
};

// What a light gives at a place, up to a factor that depends on its size and kind alone: 0 if it does not shine there at all.
double shine(const rp_light& light, const Float4& place) {
    double to[3], squared = 0;
    for (int i = 0; i < 3; i++) to[i] = double(place[i]) - light.p[i], squared += to[i] * to[i];
    const double y = light.radiance[0] + light.radiance[1] + light.radiance[2];
    if (light.kind != RP_LIGHT_TRIANGLE || light.flags & RP_LIGHT_TWO_SIDED) return y / squared;
    const auto &a = light.e1, &b = light.e2;
    const double n[3] = {double(a[1]) * b[2] - double(a[2]) * b[1], double(a[2]) * b[0] - double(a[0]) * b[2],
                         double(a[0]) * b[1] - double(a[1]) * b[0]};
    const double cosine = (n[0] * to[0] + n[1] * to[1] + n[2] * to[2]) / (2 * light.area * std::sqrt(squared));
    return std::max(0.0, cosine) * y / squared;
}

TEST_F(LightTreeChoice, small_and_large_sets_are_distributions) {
    std::mt19937 random(3);
    for (const auto [count, others] : {std::array{2u, 0u}, std::array{3u, 1u}, std::array{40u, 3u}, std::array{300u, 0u}}) {
        upload(support::many_lights(count, others, count));
        const std::vector<Float4> places = some_places(random, 24);
        const std::vector<float> all = chances(places);
        double without_place = 0;
        for (size_t i = 0; i < lights_.size(); i++)
            if (!has_place(i)) without_place += lights_[i].probability;
        for (size_t p = 0; p < places.size(); p++) {
            double sum = without_place;
            for (size_t i = 0; i < lights_.size(); i++) {
                const float chance = all[p * lights_.size() + i];
                sum += chance;
                if (has_place(i) && shine(lights_[i], places[p]) > 0) {
                    EXPECT_GT(chance, 0) << i << " of " << count;
                }
            }
            // Every number chooses one light; what is added up here is rounded.
            EXPECT_NEAR(sum, 1, 1e-5) << count << ", place " << p;
        }
    }
}

TEST_F(LightTreeChoice, small_samples_have_the_chance_that_is_found_at_hits) {
    std::mt19937 random(4);
    upload(support::many_lights(50, 2, 9));
    const std::vector<Float4> places = some_places(random, 512);
    std::vector<std::array<uint32_t, 2>> numbers;
    for (size_t i = 0; i < places.size(); i++) numbers.push_back({static_cast<uint32_t>(random()), static_cast<uint32_t>(random())});
    numbers[0] = {0, 0};
    numbers[1] = {UINT32_MAX, UINT32_MAX};
    for (const Chosen& chosen : choose(places, numbers)) {
        ASSERT_LT(chosen.light, lights_.size());
        EXPECT_EQ(chosen.chance, has_place(chosen.light) ? chosen.by_way : lights_[chosen.light].probability);
        EXPECT_GT(chosen.chance, 0);
        EXPECT_GE(chosen.rest, 0);
        EXPECT_LT(chosen.rest, 1);
    }
}

// Chi-square of how often each light is chosen at a place, by numbers that are evenly spread; and of the rest, in ten parts.
TEST_F(LightTreeChoice, lights_come_as_often_as_their_chance_says) {
    constexpr uint32_t samples = 1 << 15;
    std::mt19937 random(5);
    upload(support::many_lights(60, 2, 11));
    for (const Float4& place : some_places(random, 6)) {
        const std::vector<float> expected = chances({place});
        std::vector<std::array<uint32_t, 2>> numbers;
        for (uint32_t i = 0; i < samples; i++) numbers.push_back({static_cast<uint32_t>(random()), static_cast<uint32_t>(random())});
        std::vector<double> met(lights_.size());
        std::array<double, 10> rests = {};
        for (const Chosen& chosen : choose(std::vector(samples, place), numbers)) {
            met[chosen.light]++;
            rests[static_cast<size_t>(chosen.rest * 10)]++;
        }
        double chi = 0, few = 0, few_expected = 0, freedom = 0;
        const auto add = [&](double count, double of) { chi += (count - of) * (count - of) / of, freedom++; };
        for (size_t i = 0; i < lights_.size(); i++) {
            const double of = samples * double{has_place(i) ? expected[i] : lights_[i].probability};
            if (of >= 8) {
                add(met[i], of);
            } else {
                few += met[i];
                few_expected += of;
            }
        }
        if (few_expected >= 8) add(few, few_expected);
        // Five standard deviations above the mean.
        EXPECT_LT(chi, freedom + 5 * std::sqrt(2 * freedom));
        chi = 0;
        for (const double count : rests) add(count, samples / 10.0);
        EXPECT_LT(chi, 9 + 5 * std::sqrt(18.0));
    }
}

// The inverse of a light's probability, over those samples that chose it, is one sample in the mean; and weights are those that hits know of.
TEST_F(LightTreeChoice, lights_in_front_of_a_surface_come_as_often_as_they_say) {
    constexpr uint32_t samples = 1 << 15;
    struct Faced {
        uint32_t light;
        float chance, weighed, by_way;
    };
    std::mt19937 random(8);
    upload(support::many_lights(40, 1, 12));
    auto kernel = get("rp_probe_light_facing");
    for (const Float4& place : some_places(random, 4)) {
        const Float4 normal = {0.6f, 0, 0.8f, 0};
        std::vector<std::array<uint32_t, 2>> numbers;
        for (uint32_t i = 0; i < samples; i++) numbers.push_back({static_cast<uint32_t>(random()), static_cast<uint32_t>(random())});
        std::vector<Faced> results(samples);
        auto at = device_->upload(bytes_of(std::vector(samples, place)), "places"),
             facing = device_->upload(bytes_of(std::vector(samples, normal)), "normals");
        auto by = device_->upload(bytes_of(numbers), "numbers"), out = device_->allocate(samples * sizeof(Faced), "results");
        ASSERT_TRUE(at.ok() && facing.ok() && by.ok() && out.ok());
        ASSERT_TRUE(kernel.set(tree_, list_, *at, *facing, *by, samples, *out).ok());
        ASSERT_TRUE(device_->kernels().launch(kernel, samples, 1).ok());
        ASSERT_TRUE(device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok());
        std::vector<double> inverse(lights_.size()), chance(lights_.size());
        for (const Faced& faced : results) {
            ASSERT_LT(faced.light, lights_.size());
            ASSERT_GT(faced.chance, 0);
            EXPECT_EQ(faced.weighed, faced.by_way);
            inverse[faced.light] += 1 / double{faced.chance};
            chance[faced.light] = faced.chance;
        }
        for (size_t i = 0; i < lights_.size(); i++)
            if (const double p = chance[i]; p > 50.0 / samples) {
                EXPECT_NEAR(inverse[i] / samples, 1, 5 * std::sqrt((1 - p) / (p * samples))) << i;
            }
    }
}

// A light that comes in at a slant gives less.
TEST_F(LightTreeChoice, small_lights_at_the_horizon_come_after_those_above) {
    std::vector<rp_light> lights(3);
    const float places[3][3] = {{1, 0, 0.02f}, {0, 0, 1}, {0, 1, -0.5f}};
    for (size_t i = 0; i < 3; i++) {
        lights[i].kind = RP_LIGHT_POINT;
        std::copy_n(places[i], 3, lights[i].p);
        for (float& channel : lights[i].radiance) channel = 1;
    }
    set_probabilities(lights, 2);
    upload(lights);
    auto kernel = get("rp_probe_light_facing");
    constexpr uint32_t samples = 4096;
    std::mt19937 random(9);
    std::vector<std::array<uint32_t, 2>> numbers;
    for (uint32_t i = 0; i < samples; i++) numbers.push_back({static_cast<uint32_t>(random()), static_cast<uint32_t>(random())});
    std::vector<std::array<uint32_t, 4>> results(samples);
    auto at = device_->upload(bytes_of(std::vector(samples, Float4{})), "places"),
         facing = device_->upload(bytes_of(std::vector(samples, Float4{0, 0, 1, 0})), "normals");
    auto by = device_->upload(bytes_of(numbers), "numbers"), out = device_->allocate(samples * 16, "results");
    ASSERT_TRUE(at.ok() && facing.ok() && by.ok() && out.ok() && kernel.set(tree_, list_, *at, *facing, *by, samples, *out).ok());
    ASSERT_TRUE(device_->kernels().launch(kernel, samples, 1).ok());
    ASSERT_TRUE(device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok());
    const auto above = std::count_if(results.begin(), results.end(), [](const auto& r) { return r[0] == 1; });
    EXPECT_GT(above, samples * 9 / 10);
}

// Two weak lights near by and a strong one far away (each by itself would take more than half by power): the near ones are what counts.
TEST_F(LightTreeChoice, small_lights_near_by_come_before_strong_ones_far_away) {
    std::vector<rp_light> lights(3);
    for (rp_light& light : lights) light.kind = RP_LIGHT_POINT;
    lights[0].p[0] = lights[0].p[1] = 300;
    lights[1].p[0] = 0.5f;
    lights[2].p[0] = -0.5f;
    for (int k = 0; k < 3; k++) lights[0].radiance[k] = 20000, lights[1].radiance[k] = lights[2].radiance[k] = 0.3f;
    set_probabilities(lights, 500);
    upload(lights);
    const std::vector<float> all = chances({{0.5f, -0.3f, 0, 0}, {0, -0.3f, 0, 0}, {250, 250, 0, 0}});
    EXPECT_GT(all[1], 0.6f);
    EXPECT_NEAR(all[4], all[5], 1e-3);
    EXPECT_GT(all[4], 0.4f);
    EXPECT_GT(all[6], 0.99f);
}

}  // namespace
}  // namespace raypager
