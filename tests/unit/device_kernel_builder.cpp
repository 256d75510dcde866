// Programs are shared among processes so that none waits for long, and none is lost.
#include <gtest/gtest.h>

#include "device/kernel_builder.hpp"

namespace raypager {
namespace {

std::vector<KernelProgram> of_bytes(const std::vector<size_t>& bytes) {
    std::vector<KernelProgram> programs;
    for (const size_t n : bytes) programs.push_back({"stage" + std::to_string(programs.size()), "", n});
    return programs;
}

std::vector<std::vector<std::string>> stages(const std::vector<std::vector<KernelProgram>>& shares) {
    std::vector<std::vector<std::string>> names;
    for (const std::vector<KernelProgram>& share : shares) {
        names.emplace_back();
        for (const KernelProgram& program : share) names.back().push_back(program.stage);
    }
    return names;
}

TEST(ShareOfKernels, the_longest_is_built_here) {
    EXPECT_EQ(stages(share_programs(of_bytes({154, 362000, 91}), 2)), (std::vector<std::vector<std::string>>{{"stage1"}, {"stage0", "stage2"}}));
}

TEST(ShareOfKernels, what_is_short_does_not_need_a_process) {
    EXPECT_EQ(stages(share_programs(of_bytes({15000, 15000, 91000}), 8))[0], (std::vector<std::string>{"stage2", "stage0", "stage1"}));
}

TEST(ShareOfKernels, one_process_builds_all) { EXPECT_EQ(share_programs(of_bytes({1, 2, 3}), 1)[0].size(), 3u); }

TEST(ShareOfKernels, those_of_a_gpu_fill_four_processes) {
    // Shading, two of extension, connection, generation, waking, and what is read back.
    const auto shares = share_programs(of_bytes({362000, 186000, 186000, 154000, 91000, 83000, 15000}), 4);
    size_t used = 0, programs = 0;
    for (const std::vector<KernelProgram>& share : shares) {
        used += share.empty() ? 0 : 1;
        programs += share.size();
    }
    EXPECT_EQ(programs, 7u);
    EXPECT_EQ(shares[0].size(), 1u);
    EXPECT_EQ(used, 4u);
}

}  // namespace
}  // namespace raypager
