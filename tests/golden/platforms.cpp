// Every OpenCL device there is (PoCL and Mesa's rusticl in CI) gives the same picture at every limit, bit for bit, and what another
// device gives, but for the last bits of floating point.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "raypager/devices.hpp"
#include "raypager/picture.hpp"
#include "reference/scenes.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

double mean(const Image& image) {
    double sum = 0;
    for (const float value : image.values) sum += value;
    return sum / static_cast<double>(image.values.size());
}

class Platforms : public testing::Test {
protected:
    // rusticl shows its software device only if asked to, before OpenCL is used for the first time in a process.
    static void SetUpTestSuite() { ::setenv("RUSTICL_ENABLE", "llvmpipe", 0); }

    void SetUp() override {
        auto found = list_devices();
        ASSERT_TRUE(found.ok()) << found.status().message();
        devices_ = *found;
        BakeOptions options;
        options.block_bytes = 16 << 10;
        auto file = support::bake_and_open(reference::cornell_small({.subdivisions = 2}, {24, 24}), options, folder_.path(), "scene");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
        ASSERT_GT(file_->scene().blocks.size(), 3u) << "too few blocks to page";
    }

    Result<MeasuredRender> run(const DeviceInfo& device, uint32_t seed, double percent, uint32_t paths, PolicyKind policy) const {
        RenderOptions options;
        options.device = std::to_string(device.index);
        options.spp = 8;
        options.seed = seed;
        options.geometry_limit_percent = percent;
        options.tuning.paths = paths;
        options.tuning.policy = policy;
        return render(*file_, options, {});
    }

    support::TemporaryFolder folder_;
    std::shared_ptr<const BlockFile> file_;
    std::vector<DeviceInfo> devices_;
};

TEST_F(Platforms, AgreeWithinAndBetween) {
#ifdef RAYPAGER_HAS_RUSTICL
    ASSERT_TRUE(std::any_of(devices_.begin(), devices_.end(), [](const DeviceInfo& device) { return device.platform == "rusticl"; }));
#endif
    Image first;
    double noise = 0;
    for (const DeviceInfo& device : devices_) {
        SCOPED_TRACE(fmt::format("{} on {}", device.name, device.platform));
        const auto resident = run(device, 0, 100, 4096, PolicyKind::aged_wants);
        ASSERT_TRUE(resident.ok()) << resident.status().message();
        for (const auto& [percent, paths, policy] : {std::tuple(40.0, 4096u, PolicyKind::lru), {1.0, 700u, PolicyKind::aged_wants}}) {
            // Policies of a kind have kernels of their own, which rusticl compiles for long.
            if (policy == PolicyKind::lru && !first.values.empty() && !support::thorough()) continue;
            const auto paged = run(device, 0, percent, paths, policy);
            ASSERT_TRUE(paged.ok()) << paged.status().message();
            EXPECT_GT(paged->report.paging.evictions, 0u);
            EXPECT_EQ(paged->report.film_hash, resident->report.film_hash) << percent << " %";
        }
        if (first.values.empty()) {
            first = resident->image;
            const auto other = run(device, 1, 100, 4096, PolicyKind::aged_wants);
            ASSERT_TRUE(other.ok()) << other.status().message();
            noise = compare_images(first, other->image)->rmse;
            continue;
        }
        // The same random numbers everywhere: only paths that a last bit sends elsewhere differ. One in a thousand would make a
        // thirtieth of the noise between two seeds (sqrt(1/1000)); a wrong kernel is off by about the noise.
        const double difference = compare_images(first, resident->image)->rmse;
        fmt::print("{}: RMSE {:.3g} against {}, {:.3g} between seeds\n", device.name, difference, devices_[0].name, noise);
        EXPECT_LT(difference, noise / 10);
        EXPECT_NEAR(mean(resident->image), mean(first), 0.01 * mean(first));
    }
}

}  // namespace
}  // namespace raypager
