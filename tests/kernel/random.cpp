// The random numbers of kernels/common/random.cl: evenly spread over samples, and without anything in common between pairs and pixels.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

using Word4 = std::array<uint32_t, 4>;
constexpr double two_to_32 = 4294967296.0;

class RandomNumbers : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
    }

    // purposes: pixel, depth, purpose, seed. Result: of purpose i, samples i * samples and on.
    std::vector<Word4> numbers(const std::vector<Word4>& purposes, uint32_t samples) {
        auto kernel = support::probe_kernel(*device_, "single_ray/probe", "rp_probe_random", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
        if (!kernel.ok()) throw std::runtime_error(kernel.status().message());
        std::vector<Word4> results(purposes.size() * samples);
        auto in = device_->upload(bytes_of(purposes), "purposes"), out = device_->allocate(results.size() * sizeof(Word4), "numbers");
        const bool done = in.ok() && out.ok() && kernel->set(*in, samples, static_cast<uint32_t>(purposes.size()), *out).ok() &&
                          device_->kernels().launch(*kernel, results.size(), 1).ok() &&
                          device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    std::unique_ptr<Device> device_;
};

// Any 2^k samples that begin at a multiple of 2^k have one point in each of the 2^k boxes, in all ways to cut the square into them.
void expect_evenly_spread(const Word4* samples, uint32_t count, uint32_t pair) {
    const auto bits = static_cast<uint32_t>(std::lround(std::log2(count)));
    for (uint32_t columns = 0; columns <= bits; columns++) {
        std::set<uint64_t> boxes;
        for (uint32_t i = 0; i < count; i++) {
            const uint64_t x = uint64_t{samples[i][2 * pair]} << columns >> 32, y = uint64_t{samples[i][2 * pair + 1]} << (bits - columns) >> 32;
            boxes.insert(x << 32 | y);
        }
        EXPECT_EQ(boxes.size(), count) << "pair " << pair << ", " << count << " samples, 2^" << columns << " columns";
    }
}

TEST_F(RandomNumbers, of_a_pair_are_evenly_spread_over_samples) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<Word4> purposes = {{0, 0, 0, 0}, {1919, 1, 1, 0}};
    for (int i = 0; i < 6; i++)
        purposes.push_back({static_cast<uint32_t>(random()), static_cast<uint32_t>(random() % 20), static_cast<uint32_t>(random() % 3),
                            static_cast<uint32_t>(random())});
    constexpr uint32_t samples = 1024;
    const std::vector<Word4> all = numbers(purposes, samples);
    for (size_t p = 0; p < purposes.size(); p++)
        for (uint32_t count = 2; count <= samples; count *= 2)
            for (uint32_t first = 0; first < samples; first += count)
                for (const uint32_t pair : {0u, 1u}) expect_evenly_spread(&all[p * samples + first], count, pair);
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); i++) sum += (a[i] - 0.5) * (b[i] - 0.5) * 12;
    return sum / static_cast<double>(a.size());
}

// Between the four numbers, and with the same number of the next pixel, depth, purpose and seed; over pixels and samples.
TEST_F(RandomNumbers, have_nothing_in_common_with_others) {
    constexpr uint32_t pixels = 512, samples = 16;
    // Of the mean of 8192 products, of which those of neighbouring samples belong together: some four standard deviations. And of the mean of
    // their squares over pixels, times the number of samples less one, which is about 1.5; it would be 9 if two pairs had their samples in the
    // same order, which random flips would hide from the first mean.
    constexpr double allowed = 5.0 / 90.5, allowed_within = 3.0;
    const auto taken = [&](uint32_t first_pixel, uint32_t depth, uint32_t purpose, uint32_t seed) {
        std::vector<Word4> purposes;
        for (uint32_t i = 0; i < pixels; i++) purposes.push_back({first_pixel + i, depth, purpose, seed});
        return numbers(purposes, samples);
    };
    const auto column = [](const std::vector<Word4>& all, size_t k) {
        std::vector<double> result;
        for (const Word4& n : all) result.push_back(n[k] / two_to_32);
        return result;
    };
    const std::vector<Word4> these = taken(1000, 1, 1, 7);
    const std::vector<std::vector<Word4>> others = {these, taken(1001, 1, 1, 7), taken(1000, 2, 1, 7), taken(1000, 1, 2, 7), taken(1000, 1, 1, 8)};
    for (size_t o = 0; o < others.size(); o++)
        for (size_t a = 0; a < 4; a++)
            for (size_t b = 0; b < 4; b++)
                if (o != 0 || a != b) {
                    SCOPED_TRACE(o);
                    const std::vector<double> x = column(these, a), y = column(others[o], b);
                    EXPECT_LT(std::fabs(correlation(x, y)), allowed) << a << ", " << b;
                    if (o == 0 && a / 2 == b / 2) continue;  // the two numbers of a pair belong together
                    double squares = 0;
                    for (uint32_t i = 0; i < pixels; i++) {
                        const auto of_pixel = [&](const std::vector<double>& all) {
                            return std::vector<double>(all.begin() + i * samples, all.begin() + (i + 1) * samples);
                        };
                        squares += std::pow(correlation(of_pixel(x), of_pixel(y)), 2) * (samples - 1) / pixels;
                    }
                    EXPECT_LT(squares, allowed_within) << a << ", " << b;
                }
    for (size_t a = 0; a < 4; a++) {
        const std::vector<double> x = column(these, a);
        EXPECT_NEAR(correlation(x, x), 1, 0.1);  // of a uniform number with itself
    }
}

TEST_F(RandomNumbers, choose_lights_in_proportion_and_leave_a_number_behind) {
    const uint32_t seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    for (const uint32_t lights : {1u, 2u, 3u, 1000u}) {
        std::set<uint32_t> ends;
        while (ends.size() + 1 < lights)
            ends.insert(static_cast<uint32_t>(random() % (lights == 1000 ? 100'000u : UINT32_MAX)));  // some have one number
        ends.insert(UINT32_MAX);
        const std::vector<uint32_t> steps(ends.begin(), ends.end());
        std::vector<uint32_t> chosen = steps;
        for (const uint32_t step : steps) chosen.push_back(step + 1);
        while (chosen.size() < 4096) chosen.push_back(static_cast<uint32_t>(random()));
        std::vector<float> fine(chosen.size());
        for (float& f : fine) f = std::uniform_real_distribution<float>(0, 0.999f)(random);

        auto kernel = support::probe_kernel(*device_, "single_ray/probe", "rp_probe_light_choice", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
        ASSERT_TRUE(kernel.ok()) << kernel.status().message();
        std::vector<std::array<uint32_t, 2>> results(chosen.size());
        auto step_buffer = device_->upload(bytes_of(steps), "steps"), number_buffer = device_->upload(bytes_of(chosen), "numbers");
        auto fine_buffer = device_->upload(bytes_of(fine), "fine"), out = device_->allocate(results.size() * 8, "results");
        ASSERT_TRUE(step_buffer.ok() && number_buffer.ok() && fine_buffer.ok() && out.ok());
        const auto count = static_cast<uint32_t>(chosen.size());
        ASSERT_TRUE(kernel->set(*step_buffer, lights, *number_buffer, *fine_buffer, count, *out).ok());
        ASSERT_TRUE(device_->kernels().launch(*kernel, count, 1).ok());
        ASSERT_TRUE(device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok());
        for (size_t i = 0; i < chosen.size(); i++) {
            const auto light = static_cast<size_t>(std::lower_bound(steps.begin(), steps.end(), chosen[i]) - steps.begin());
            ASSERT_EQ(results[i][0], light);
            const double first = light ? steps[light - 1] + 1.0 : 0.0, width = steps[light] - first + 1;
            const float rest = std::bit_cast<float>(results[i][1]);
            EXPECT_NEAR(rest, (chosen[i] - first + double{fine[i]}) / width, 1e-6);
            EXPECT_GE(rest, 0.0f);
            EXPECT_LT(rest, 1.0f);
        }
    }
}

}  // namespace
}  // namespace raypager
