// Processes that build kernels: include/raypager/kernel_builder.hpp.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "raypager/kernel_builder.hpp"

namespace raypager {

bool has_kernel_builder();

// Some that run at the same time. They are waited for.
class KernelBuilders {
public:
    KernelBuilders() = default;
    ~KernelBuilders() { wait(); }
    KernelBuilders(const KernelBuilders&) = delete;
    KernelBuilders& operator=(const KernelBuilders&) = delete;

    // Where it cannot be started, nothing is built; whoever wants the kernels finds out.
    void start(const std::string& device, const std::string& stage, const std::string& definitions);
    void wait();

private:
    std::vector<pid_t> processes_;
};

}  // namespace raypager
