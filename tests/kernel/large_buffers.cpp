// Buffers that are cleared in several pieces.
#include <gtest/gtest.h>

#include <array>

#include "device/device.hpp"

namespace raypager {
namespace {

TEST(LargeBuffers, are_zeros_from_one_end_to_the_other) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    constexpr uint64_t gibibyte = uint64_t{1} << 30, bytes = gibibyte + 24;
    if ((*device)->info().max_allocation_bytes < bytes) GTEST_SKIP() << "this device has no such buffers";
    auto buffer = (*device)->allocate(bytes, "a large buffer");
    ASSERT_TRUE(buffer.ok()) << buffer.status().message();
    Queue& queue = (*device)->kernels();
    std::array<std::byte, 48> ones;
    ones.fill(std::byte{1});
    ASSERT_TRUE(queue.write_now(*buffer, 0, ones).ok());
    ASSERT_TRUE(queue.write_now(*buffer, gibibyte - 24, ones).ok());
    ASSERT_TRUE(queue.fill_zero(*buffer, 4, bytes - 8).ok());
    for (const uint64_t at : {uint64_t{0}, gibibyte - 24}) {
        std::array<std::byte, 48> found;
        ASSERT_TRUE(queue.read_now(*buffer, at, found).ok());
        for (size_t i = 0; i < found.size(); i++) {
            const bool kept = at + i < 4 || at + i >= bytes - 4;
            EXPECT_EQ(found[i], std::byte{kept}) << at + i;
        }
    }
}

}  // namespace
}  // namespace raypager
