// Persistent threads take each ray of a queue once (kernels/single_ray/persistent.cl).
#include <gtest/gtest.h>

#include "raypager/abi/path.h"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

class SmallParts : public testing::TestWithParam<uint32_t> {};

TEST_P(SmallParts, each_ray_is_taken_once) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    const uint64_t group = (*device)->group_size();
    for (const std::string& persistent : {(*device)->camera_definitions(), (*device)->bounce_definitions()}) {
        auto kernel = support::probe_kernel(**device, "single_ray/probe", "rp_probe_parts", "-DRP_SLABS=1 -DRP_STACK_SIZE=96" + persistent);
        ASSERT_TRUE(kernel.ok()) << kernel.status().message();
        // One work-group starts in one part and has to find the others.
        for (const uint64_t groups : {1, 2, 5}) {
            const uint32_t count = GetParam();
            std::vector<uint32_t> taken(RP_MAX_PARTS), times(count + 1);
            auto taken_buffer = (*device)->upload(bytes_of(taken), "what is taken"), times_buffer = (*device)->upload(bytes_of(times), "how often");
            ASSERT_TRUE(taken_buffer.ok() && times_buffer.ok());
            ASSERT_TRUE(kernel->set(count, *taken_buffer, *times_buffer).ok());
            ASSERT_TRUE((*device)->kernels().launch(*kernel, groups * group, group).ok());
            ASSERT_TRUE((*device)->kernels().read_now(*times_buffer, 0, std::as_writable_bytes(std::span(times))).ok());
            for (uint32_t i = 0; i < count; i++) ASSERT_EQ(times[i], 1u) << "ray " << i << " of " << count << ", " << groups << " work-groups";
            EXPECT_EQ(times[count], 0u);
        }
    }
}

// Around one run and three of them, as they are where parts are only there to be tested, and around such as an NVIDIA GPU has.
INSTANTIATE_TEST_SUITE_P(rays, SmallParts, testing::Values(0, 1, 15, 16, 17, 47, 48, 49, 1000, 135'169));

}  // namespace
}  // namespace raypager
