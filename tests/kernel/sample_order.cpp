// The order of samples: kernels number them as the host does.
#include "wavefront/sample_order.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "raypager/abi/path.h"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

TEST(SampleOrder, kernels_number_samples_as_the_host_does) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "single_ray/probe", "rp_probe_order", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    struct Picture {
        uint32_t width, height, tile, together, spp, region;
    };
    for (const Picture& p :
         {Picture{37, 23, 16, 1, 3, 0}, Picture{37, 23, 16, 16, 17, 0}, Picture{5, 3, 2, 4, 10, 0}, Picture{64, 32, 8, 16, 16, 0},
          Picture{1, 40, 7, 3, 5, 0}, Picture{16, 16, 100, 64, 70, 0}, Picture{37, 23, 16, 16, 17, 100}, Picture{5, 3, 2, 4, 10, 14},
          Picture{5, 3, 2, 4, 2100, 4}, Picture{5, 3, 2, 1, 1500, 1}, Picture{64, 32, 8, 7, 100, 512}}) {
        const rp_sample_order order = make_order(p.tile, p.together, p.spp, uint64_t{p.width} * p.height, p.region);
        const uint64_t total = uint64_t{p.width} * p.height * p.spp;
        std::vector<rp_path_sample> samples(total);
        auto out = (*device)->allocate(total * sizeof(rp_path_sample), "samples");
        ASSERT_TRUE(out.ok());
        const std::array<cl_uint, 4> words = {order.tile_size, order.together, order.grouped_passes, order.region};
        ASSERT_TRUE(kernel->set(words, p.width, p.height, cl_ulong{0}, static_cast<cl_uint>(total), *out).ok());
        ASSERT_TRUE((*device)->kernels().launch(*kernel, total, 1).ok());
        ASSERT_TRUE((*device)->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(samples))).ok());
        for (uint64_t number = 0; number < total; number++) {
            ASSERT_LT(samples[number].pixel, p.width * p.height);
            ASSERT_LT(samples[number].sample, p.spp);
            ASSERT_EQ(sample_number(order, p.width, p.height, samples[number].pixel, samples[number].sample), number)
                << p.width << "x" << p.height << ", groups of " << order.together << ", regions of " << order.region;
        }
    }
}

TEST(SampleOrder, of_large_pictures_too) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "single_ray/probe", "rp_probe_order", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    constexpr uint32_t width = 40000, height = 30000, count = 1000;  // 1.2e9 pixels: groups of at most three
    const rp_sample_order order = make_order(16, 64, 6, uint64_t{width} * height);
    EXPECT_EQ(order.together, 3u);
    std::vector<rp_path_sample> samples(count);
    auto out = (*device)->allocate(count * sizeof(rp_path_sample), "samples");
    ASSERT_TRUE(out.ok());
    const std::array<cl_uint, 4> words = {order.tile_size, order.together, order.grouped_passes, order.region};
    const uint64_t pass = uint64_t{width} * height;  // one, and five in groups of three and two
    for (const uint64_t first : {pass - count / 2, 4 * pass - count / 2, 6 * pass - count}) {
        ASSERT_TRUE(kernel->set(words, width, height, cl_ulong{first}, count, *out).ok());
        ASSERT_TRUE((*device)->kernels().launch(*kernel, count, 1).ok());
        ASSERT_TRUE((*device)->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(samples))).ok());
        for (uint32_t i = 0; i < count; i++) ASSERT_EQ(sample_number(order, width, height, samples[i].pixel, samples[i].sample), first + i);
    }
    // Numbers, stretches and regions of more than 32 bits.
    const rp_sample_order regions = make_order(16, 64, 3000, uint64_t{width} * height, 500'000'000);
    const std::array<cl_uint, 4> region_words = {regions.tile_size, regions.together, regions.grouped_passes, regions.region};
    const uint64_t pixels = uint64_t{width} * height, stretch = 375 * pixels, region = 2625 * uint64_t{regions.region};  // 3000 / 8, and what follows
    for (const uint64_t first :
         {188 * pixels - count / 2, stretch - count / 2, stretch + region - count / 2, stretch + 2 * region - count / 2, 3000 * pixels - count}) {
        ASSERT_TRUE(kernel->set(region_words, width, height, cl_ulong{first}, count, *out).ok());
        ASSERT_TRUE((*device)->kernels().launch(*kernel, count, 1).ok());
        ASSERT_TRUE((*device)->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(samples))).ok());
        for (uint32_t i = 0; i < count; i++) ASSERT_EQ(sample_number(regions, width, height, samples[i].pixel, samples[i].sample), first + i);
    }
}

}  // namespace
}  // namespace raypager
