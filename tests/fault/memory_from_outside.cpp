// The limits as the operating system sees them: on a CPU device, the process's largest resident set holds the device's buffers, the host's
// cache of blocks, and a rest that the limits do not change.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "raypager/bake.hpp"
#include "raypager/devices.hpp"
#include "support/child_process.hpp"
#include "support/device_scene.hpp"
#include "support/sanitizers.hpp"
#include "support/small_scene.hpp"

namespace raypager {
namespace {

using support::ChildProcess;
using support::ChildResult;
using support::MiB;

// README.md, "Limits": what the program takes beside its limits. Program, libraries and PoCL are three quarters of it.
constexpr uint64_t stated_constant = uint64_t{256} << 20;
// The first render, which compiles its kernels, takes more: measured 387 MiB on two cores.
constexpr uint64_t stated_while_compiling = uint64_t{512} << 20;

class MemoryFromOutside : public testing::Test {
protected:
    void SetUp() override {
#if RAYPAGER_ADDRESS_SANITIZER || RAYPAGER_THREAD_SANITIZER
        GTEST_SKIP() << "sanitizers need memory of their own";
#endif
        const auto devices = list_devices();
        ASSERT_TRUE(devices.ok());
        for (const DeviceInfo& device : *devices)
            if (device.is_default && !device.profile.shares_host_memory) GTEST_SKIP() << "the default device keeps its buffers elsewhere";
        BakeOptions options;
        options.block_bytes = 256 << 10;
        auto file = support::bake_and_open(support::small_scene(900), options, folder_.path(), "scene");  // 1.6 million triangles
        ASSERT_TRUE(file.ok()) << file.status().message();
        geometry_ = (*file)->scene().geometry_bytes(support::default_form());
        ASSERT_GT(geometry_, 30 * MiB);
    }

    // Peak resident set of a render.
    uint64_t peak(uint64_t memory_limit, uint64_t host_limit, const std::string& size = "64x48") {
        ChildProcess child(RAYPAGER_WHOLE_PROGRAM,
                           {"render", "scene.rpb", "-o", "a.pfm", "--size", size, "--spp", "1", "--paths", "4096", "--memory-limit",
                            std::to_string(memory_limit), "--host-limit", std::to_string(host_limit), "--report", "report.json"},
                           folder_.path());
        ChildResult result;
        EXPECT_TRUE(child.wait(120, result));
        EXPECT_EQ(result.exit_code, 0);
        std::ifstream file(folder_.path() / "report.json");
        const auto report = nlohmann::json::parse(file, nullptr, false);
        if (!report.is_object()) return 0;
        EXPECT_LE(report["peak"]["memory_bytes"], memory_limit);
        EXPECT_LE(report["peak"]["host_bytes"], host_limit);
        EXPECT_GT(report["peak"]["memory_bytes"], memory_limit * 3 / 4) << "the limit is not used";
        return result.peak_bytes;
    }

    support::TemporaryFolder folder_;
    uint64_t geometry_ = 0;
};

// What differs from run to run, mostly in the allocator of the C library: measured below 3 MiB.
constexpr uint64_t noise = 8 * MiB;

// One test, for baking the scene takes longest.
TEST_F(MemoryFromOutside, stays_within_the_limits_and_a_constant) {
    EXPECT_LE(peak(4 * MiB, 2 * MiB), (4 + 2) * MiB + stated_while_compiling);  // unless other tests have left the kernels in a cache
    const uint64_t small = peak(4 * MiB, 2 * MiB);
    EXPECT_LE(small, (4 + 2) * MiB + stated_constant);
    for (const uint64_t memory : {8 * MiB, 12 * MiB, 20 * MiB, 28 * MiB}) {
        const uint64_t bytes = peak(memory, 26 * MiB);
        SCOPED_TRACE(fmt::format("memory limit {}: {} bytes, {} with the smallest limits", memory, bytes, small));
        EXPECT_LE(bytes, memory + 26 * MiB + stated_constant);
        // A constant that large could hide much: so limits that are larger by so much may cost only so much more.
        EXPECT_LE(bytes, small + memory + (26 - 4 - 2) * MiB + noise);
        EXPECT_GE(bytes + noise, small + memory - 4 * MiB) << "the device's buffers are not in the resident set; this test sees nothing";
    }
    // Film and picture: 32 bytes per pixel on the device, 12 on the host. A film that has room on the device never lies in host memory as a whole;
    // one that is there in parts does, and beside it such a part, of at most a quarter of the limit.
    constexpr uint64_t pixels = 1024 * 768;
    EXPECT_LE(peak(4 * MiB + 64 * pixels, 2 * MiB, "1024x768"), small + (64 + 12) * pixels + noise);
    EXPECT_LE(peak(4 * MiB + 32 * pixels, 2 * MiB, "1024x768"), small + (32 + 12 + 32 + 8) * pixels + noise);
}

}  // namespace
}  // namespace raypager
