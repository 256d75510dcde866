// Kernels that other processes build: found in the cache, and built by this process where those fail.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "device/device.hpp"
#include "raypager/kernel_builder.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

class KernelBuilder : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0, {{find_profile_field("cache-kernels"), 1}, {find_profile_field("build-processes"), 3}}, nullptr);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
        // Afterwards: by then PoCL knows where its own cache is, which outlives this test.
        if (const char* set = std::getenv("XDG_CACHE_HOME")) before_ = set;
        ASSERT_EQ(setenv("XDG_CACHE_HOME", folder_.path().c_str(), 1), 0);
        // Two are built here, and each of two processes builds one, as long as their texts have 75 to 150 KB (share_programs).
        for (const char* definition : {" -DRP_A", " -DRP_B", " -DRP_C", " -DRP_D"})
            names_.push_back({"single_ray/generate", "rp_advance", definition});
    }

    void TearDown() override {
        set_kernel_builder({});
        before_.empty() ? unsetenv("XDG_CACHE_HOME") : setenv("XDG_CACHE_HOME", before_.c_str(), 1);
    }

    size_t cached() const {
        const std::filesystem::path kernels = folder_.path() / "raypager" / "kernels";
        if (!std::filesystem::exists(kernels)) return 0;
        size_t files = 0;
        for ([[maybe_unused]] const auto& file : std::filesystem::directory_iterator(kernels)) files++;
        return files;
    }

    void expect_kernels() {
        for (const KernelName& name : names_) {
            const auto kernel = device_->kernel(name);
            EXPECT_TRUE(kernel.ok()) << kernel.status().message();
        }
        EXPECT_EQ(cached(), names_.size());
    }

    support::TemporaryFolder folder_;
    std::string before_;
    std::unique_ptr<Device> device_;
    std::vector<KernelName> names_;
};

TEST_F(KernelBuilder, processes_fill_the_cache) {
    set_kernel_builder({RAYPAGER_PROGRAM, "build-kernels"});
    device_->build_ahead(names_);
    EXPECT_EQ(cached(), 4u);
    expect_kernels();
    // What is there is not built again.
    const std::filesystem::path trace = folder_.path() / "started";
    set_kernel_builder({"/bin/touch", trace});
    device_->build_ahead(names_);
    EXPECT_FALSE(std::filesystem::exists(trace));
}

TEST_F(KernelBuilder, a_process_that_fails_is_not_missed) {
    set_kernel_builder({"/bin/false"});
    device_->build_ahead(names_);
    EXPECT_EQ(cached(), 2u) << "those that are built here";
    expect_kernels();
}

TEST_F(KernelBuilder, a_process_that_cannot_be_started_is_not_missed) {
    set_kernel_builder({"/no/such/program"});
    device_->build_ahead(names_);
    EXPECT_EQ(cached(), 2u);
    expect_kernels();
}

TEST_F(KernelBuilder, none_is_started_unless_it_is_named) {
    device_->build_ahead(names_);
    EXPECT_EQ(cached(), 0u);
}

}  // namespace
}  // namespace raypager
