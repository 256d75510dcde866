// Buffers that are cleared in several pieces.
#include <gtest/gtest.h>

#include <array>

#include "base/memory.hpp"
#include "device/device.hpp"

namespace raypager {
namespace {

TEST(LargeBuffers, are_zeros_from_one_end_to_the_other) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    constexpr uint64_t gibibyte = uint64_t{1} << 30, bytes = gibibyte + 27;
    if ((*device)->info().max_allocation_bytes < bytes || available_memory() < 4 * gibibyte) GTEST_SKIP() << "there is no room for such buffers";
    auto buffer = (*device)->allocate(bytes, "a large buffer");
    ASSERT_TRUE(buffer.ok()) << buffer.status().message();
    Queue& queue = (*device)->kernels();
    std::array<std::byte, 48> ones;
    ones.fill(std::byte{1});
    ASSERT_TRUE(queue.write_now(*buffer, 0, ones).ok());
    ASSERT_TRUE(queue.write_now(*buffer, bytes - ones.size(), ones).ok());
    ASSERT_TRUE(queue.fill_zero(*buffer, 4, bytes - 9).ok());
    for (const uint64_t at : {uint64_t{0}, bytes - ones.size()}) {
        std::array<std::byte, 48> found;
        ASSERT_TRUE(queue.read_now(*buffer, at, found).ok());
        for (size_t i = 0; i < found.size(); i++) {
            const bool kept = at + i < 4 || at + i >= bytes - 5;
            EXPECT_EQ(found[i], std::byte{kept}) << at + i;
        }
    }
}

}  // namespace
}  // namespace raypager
