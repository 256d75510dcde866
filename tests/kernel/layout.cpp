// Structs that host and kernels share have the same size on both sides, and the kernels' sources expand.
#include <gtest/gtest.h>

#include "device/device.hpp"
#include "device/program_cache.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/light_tree.h"
#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"
#include "raypager/abi/wide.h"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

TEST(Layout, struct_sizes_agree) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto kernel = support::probe_kernel(**device, "single_ray/probe", "rp_struct_sizes", "-DRP_SLABS=1 -DRP_STACK_SIZE=96");
    ASSERT_TRUE(kernel.ok()) << kernel.status().message();
    const std::vector<uint32_t> expected = {sizeof(rp_node),
                                            sizeof(rp_leaf),
                                            sizeof(rp_block_header),
                                            sizeof(rp_block_entry),
                                            sizeof(rp_top_grid),
                                            sizeof(rp_page),
                                            sizeof(rp_material),
                                            sizeof(rp_light),
                                            sizeof(rp_primitive_range),
                                            sizeof(rp_camera),
                                            sizeof(rp_render_params),
                                            sizeof(rp_path_sample),
                                            sizeof(rp_wide_node),
                                            sizeof(rp_wide_leaf),
                                            sizeof(rp_wide_header),
                                            sizeof(rp_wide_block_entry),
                                            sizeof(rp_page_changes),
                                            sizeof(rp_light_node),
                                            sizeof(rp_instance),
                                            sizeof(rp_object),
                                            sizeof(rp_instance_traits)};
    auto buffer = (*device)->allocate(expected.size() * sizeof(uint32_t), "sizes");
    ASSERT_TRUE(buffer.ok());
    ASSERT_TRUE(kernel->set(*buffer).ok());
    ASSERT_TRUE((*device)->kernels().launch(*kernel, 1, 1).ok());
    std::vector<uint32_t> sizes(expected.size());
    ASSERT_TRUE((*device)->kernels().read_now(*buffer, 0, std::as_writable_bytes(std::span(sizes))).ok());
    EXPECT_EQ(sizes, expected);
}

TEST(Layout, offsets_that_kernels_rely_on) {
    // Kernels read these structs as vectors of four words.
    EXPECT_EQ(offsetof(rp_child, ref), 12u);
    EXPECT_EQ(offsetof(rp_block_entry, block), 12u);
    EXPECT_EQ(offsetof(rp_block_entry, root), 28u);
    EXPECT_EQ(offsetof(rp_wide_block_entry, block), 12u);
    EXPECT_EQ(sizeof(rp_block_header) % 16, 0u);
    EXPECT_EQ(offsetof(rp_render_params, stage_begin) % 8, 0u);
}

TEST(KernelSources, every_stage_expands_without_includes) {
    for (const char* stage : {"single_ray/publish", "single_ray/wake", "single_ray/generate", "single_ray/extend", "single_ray/connect",
                              "single_ray/probe", "stream/wake", "stream/generate", "stream/extend", "stream/connect", "stream/trace",
                              "stream/all_stages", "stream/probe", "shading/shade"}) {
        auto text = expand_kernel_source(std::string(stage) + ".cl", support::probe_sources());
        ASSERT_TRUE(text.ok()) << text.status().message();
        EXPECT_EQ(text->find("#include \""), std::string::npos) << stage;
        EXPECT_EQ(text->find("\n//"), std::string::npos) << stage;
        // Guarded files come once, unless it was within a condition that they came first.
        const auto guard = text->find("#define RAYPAGER_ABI_TYPES_H");
        ASSERT_NE(guard, std::string::npos) << stage;
        EXPECT_EQ(text->find("#define RAYPAGER_ABI_TYPES_H", guard + 1), std::string::npos) << stage;
        EXPECT_GT(text->size(), 500u);
    }
}

TEST(KernelSources, unknown_source_is_an_error) {
    EXPECT_FALSE(expand_kernel_source("single_ray/none.cl").ok());
    EXPECT_FALSE(expand_kernel_source("single_ray/probe.cl").ok()) << "kernels of tests are no part of the program";
}

TEST(KernelSources, a_kernel_that_does_not_build_is_one_clear_line) {
    auto device = Device::open("", 0);
    ASSERT_TRUE(device.ok()) << device.status().message();
    // Without RP_STACK_SIZE the source is not valid.
    auto kernel = (*device)->kernel({"single_ray/extend", "rp_extend", "-DRP_SLABS=1"});
    ASSERT_FALSE(kernel.ok());
    EXPECT_NE(kernel.status().message().find("single_ray/extend.cl"), std::string::npos);
    EXPECT_EQ(kernel.status().message().find('\n'), std::string::npos);
}

TEST(DeviceSelection, unknown_device_is_a_usage_error) {
    auto device = Device::open("no such device", 0);
    ASSERT_FALSE(device.ok());
    EXPECT_EQ(device.status().exit_code(), 2);
}

TEST(MemoryBudget, refuses_what_would_pass_the_limit_and_counts_the_peak) {
    auto device = Device::open("", 1000);
    ASSERT_TRUE(device.ok()) << device.status().message();
    const MemoryBudget& budget = (*device)->budget();
    {
        auto first = (*device)->allocate(600, "first");
        ASSERT_TRUE(first.ok());
        auto second = (*device)->allocate(401, "second");
        ASSERT_FALSE(second.ok());
        EXPECT_NE(second.status().message().find("1001"), std::string::npos) << second.status().message();
        EXPECT_EQ(budget.used(), 600u);
        Buffer moved = std::move(*first);
        auto third = (*device)->allocate(400, "third");
        EXPECT_TRUE(third.ok());
        EXPECT_EQ(budget.used(), 1000u);
    }
    EXPECT_EQ(budget.used(), 0u);
    EXPECT_EQ(budget.peak(), 1000u);
}

}  // namespace
}  // namespace raypager
