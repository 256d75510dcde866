// Kernels that only tests have (tests/support/kernels): they call parts of kernels/ from outside a render. The build puts their sources into the
// tests, not into the program.
#pragma once

#include <string>
#include <vector>

#include "device/device.hpp"
#include "device/kernel_sources.hpp"

namespace raypager::support {

const std::vector<KernelSource>& probe_sources();

// As Device::kernel, also for stages of tests. Those of shading are built as renders build theirs.
inline Result<Kernel> probe_kernel(Device& device, const std::string& stage, const std::string& name, const std::string& definitions) {
    device.use_more_sources(probe_sources());
    return device.kernel({stage, name, (stage.starts_with("shading/") ? device.quick_arithmetic() : "") + definitions});
}

}  // namespace raypager::support
