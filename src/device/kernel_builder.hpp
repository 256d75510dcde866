// Processes that build kernels: include/raypager/kernel_builder.hpp.
#pragma once

#include <sys/types.h>

#include <span>
#include <string>
#include <vector>

#include "raypager/kernel_builder.hpp"

namespace raypager {

bool has_kernel_builder();

// What is compiled at once: a file of kernels, and how.
struct KernelProgram {
    std::string stage, definitions;  // as in KernelName
    size_t text_bytes = 0;
};

// Divides programs among processes so that all are done soon, as far as the lengths of their texts can tell. The first share is that of the process
// that asks; it need not be started, and gets the longest. Shares may be empty.
std::vector<std::vector<KernelProgram>> share_programs(std::vector<KernelProgram> programs, size_t processes);

// Some that run at the same time. They are waited for.
class KernelBuilders {
public:
    KernelBuilders() = default;
    ~KernelBuilders() { wait(); }
    KernelBuilders(const KernelBuilders&) = delete;
    KernelBuilders& operator=(const KernelBuilders&) = delete;

    // One that builds these. Where it cannot be started, nothing is built; whoever wants the kernels finds out.
    void start(const std::string& device, std::span<const KernelProgram> programs);
    void wait();

private:
    std::vector<pid_t> processes_;
};

}  // namespace raypager
