// The box test of the kernels is conservative: whatever a ray meets inside a box in exact arithmetic, the quantised box lets it through,
// and says that it is entered no later than that. Rays from near and very far, boxes flat and thick, near the origin and far from it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "block/grid.hpp"
#include "device/device.hpp"
#include "property/passage.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

struct DeviceFloat4 {
    float x, y, z, w;
};
struct Word4 {
    uint32_t x, y, z, w;
};

class BoxTest : public testing::TestWithParam<int> {};

TEST_P(BoxTest, lets_every_ray_through_that_meets_the_box) {
    const int scale_exponent = GetParam();
    const uint64_t seed = 4711 + static_cast<uint64_t>(scale_exponent + 50);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    constexpr uint32_t count = 200000;
    const double scale = std::ldexp(1.0, scale_exponent);
    std::vector<DeviceFloat4> rays, grids;
    std::vector<Word4> boxes;
    std::vector<Passage> truth;
    for (uint32_t i = 0; i < count; i++) {
        // A block somewhere, and a box in it; some axes flat.
        Box bounds, box;
        float(&lower)[3] = bounds.lower, (&upper)[3] = bounds.upper, (&low)[3] = box.lower, (&high)[3] = box.upper;
        const double away = unit(random) < 0.5 ? 0 : std::ldexp(scale, static_cast<int>(unit(random) * 12));
        for (int k = 0; k < 3; k++) {
            const double begin = (unit(random) - 0.5) * 2 * away, thin = std::pow(unit(random), 3);
            // Something with an area is extended along some axis.
            const double extent = scale * (k == static_cast<int>(i % 3) ? 1e-3 + thin : unit(random) < 0.15 ? 0 : thin);
            lower[k] = static_cast<float>(begin);
            upper[k] = std::max(lower[k], static_cast<float>(begin + extent));
            const double a = unit(random), b = unit(random), width = double(upper[k]) - lower[k];
            low[k] = std::min(upper[k], static_cast<float>(lower[k] + width * std::min(a, b)));
            high[k] =
                std::min(upper[k], std::max(low[k], static_cast<float>(lower[k] + width * (unit(random) < 0.2 ? std::min(a, b) : std::max(a, b)))));
        }
        const Grid grid = make_grid(bounds);
        const rp_child child = quantise(grid, box, 0);
        // A ray through a point of the box, from close by or from up to a million times the largest coordinate away (from farther, floats
        // cannot tell the scene from a point).
        float largest = 0;
        for (int k = 0; k < 3; k++) largest = std::max({largest, std::abs(lower[k]), std::abs(upper[k])});
        const double far = unit(random) < 0.2 ? 0 : std::ldexp(largest, static_cast<int>(unit(random) * 24) - 4);
        float point[3], origin[3], direction[3];
        double length = 0;
        for (int k = 0; k < 3; k++) {
            point[k] = std::clamp(static_cast<float>(low[k] + (double(high[k]) - low[k]) * unit(random)), low[k], high[k]);
            origin[k] = static_cast<float>(point[k] + far * (unit(random) - 0.5));
            if (unit(random) < 0.2) origin[k] = point[k];
            direction[k] = static_cast<float>(double(point[k]) - origin[k]);
            length += double(direction[k]) * direction[k];
        }
        for (int k = 0; k < 3; k++)  // rays have unit directions
            direction[k] = length > 0 ? static_cast<float>(direction[k] / std::sqrt(length)) : k == 0 ? 1.0f : 0.0f;
        rays.push_back({origin[0], origin[1], origin[2], INFINITY});
        rays.push_back({direction[0], direction[1], direction[2], 0});
        grids.push_back({grid.origin[0], grid.origin[1], grid.origin[2], 0});
        grids.push_back({grid.cell[0], grid.cell[1], grid.cell[2], 0});
        boxes.push_back({child.x, child.y, child.z, 0});
        truth.push_back(exact_passage(origin, direction, box));
    }
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "single_ray/probe", "rp_probe_boxes", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    auto ray_buffer = (*device)->upload(bytes_of(rays), "rays"), grid_buffer = (*device)->upload(bytes_of(grids), "grids");
    auto box_buffer = (*device)->upload(bytes_of(boxes), "boxes");
    auto results = (*device)->allocate(count * 8, "results");
    ASSERT_TRUE(ray_buffer.ok() && grid_buffer.ok() && box_buffer.ok() && results.ok());
    ASSERT_TRUE(kernel->set(*ray_buffer, *grid_buffer, *box_buffer, count, *results).ok());
    ASSERT_TRUE((*device)->kernels().launch(*kernel, count, (*device)->group_size()).ok());
    std::vector<std::array<float, 2>> found(count);
    ASSERT_TRUE((*device)->kernels().read_now(*results, 0, std::as_writable_bytes(std::span(found))).ok());
    const auto describe = [&](uint32_t i) {
        const DeviceFloat4 &o = rays[2 * i], &d = rays[2 * i + 1], &g = grids[2 * i], &c = grids[2 * i + 1];
        return fmt::format("origin {} {} {} direction {} {} {} grid {} {} {} cell {} {} {} box {:x} {:x} {:x}, truly met from {} to {}", o.x, o.y,
                           o.z, d.x, d.y, d.z, g.x, g.y, g.z, c.x, c.y, c.z, boxes[i].x, boxes[i].y, boxes[i].z, truth[i].entry, truth[i].exit);
    };
    uint32_t met = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (truth[i].entry > truth[i].exit) continue;  // rounding of the direction made it miss
        met++;
        // Compared as the kernels do.
        ASSERT_LE(std::bit_cast<int32_t>(found[i][0]), std::bit_cast<int32_t>(found[i][1]))
            << "box " << i << " was missed, seed " << seed << ": " << describe(i);
        // Hits in the box are not before its entry; traversal compares with the same widening.
        ASSERT_LE(found[i][0], truth[i].exit * 1.000002 + 1e-30) << "box " << i << " is entered after it is left, seed " << seed;
    }
    EXPECT_GT(met, count / 2) << "seed " << seed;
}

INSTANTIATE_TEST_SUITE_P(scales, BoxTest, testing::Values(-40, -10, 0, 10, 30),
                         [](const auto& param) { return (param.param < 0 ? "minus_" : "plus_") + std::to_string(std::abs(param.param)); });

// The edge functions of a triangle are told apart by their bits; numbers next to 0, and 0 of either sign, are what that could get wrong.
TEST(Signs, differ_where_one_number_is_below_0_and_one_above) {
    constexpr float tiny = std::numeric_limits<float>::denorm_min(), great = std::numeric_limits<float>::max();
    const float values[] = {0.0f, -0.0f, tiny, -tiny, 1.0f, -1.0f, great, -great};
    std::vector<float> numbers;
    for (const float u : values)
        for (const float v : values)
            for (const float w : values) numbers.insert(numbers.end(), {u, v, w});
    const auto count = static_cast<uint32_t>(numbers.size() / 3);
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "single_ray/probe", "rp_probe_signs", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    auto rows = (*device)->upload(bytes_of(numbers), "numbers");
    auto results = (*device)->allocate(count * sizeof(uint32_t), "results");
    ASSERT_TRUE(rows.ok() && results.ok());
    ASSERT_TRUE(kernel->set(*rows, count, *results).ok());
    ASSERT_TRUE((*device)->kernels().launch(*kernel, count, (*device)->group_size()).ok());
    std::vector<uint32_t> found(count);
    ASSERT_TRUE((*device)->kernels().read_now(*results, 0, std::as_writable_bytes(std::span(found))).ok());
    for (uint32_t i = 0; i < count; i++) {
        const float *of = &numbers[3 * i], least = std::min({of[0], of[1], of[2]}), greatest = std::max({of[0], of[1], of[2]});
        EXPECT_EQ(found[i] != 0, least < 0 && greatest > 0) << of[0] << ' ' << of[1] << ' ' << of[2];
    }
}

}  // namespace
}  // namespace raypager
