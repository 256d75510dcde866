// Kernel sources -> built programs, with a cache of binaries in $XDG_CACHE_HOME/raypager/kernels (or ~/.cache). The name of a binary
// covers everything that it depends on: source text, options, device, driver and platform. A binary that does not load is built anew.
// Drivers that keep such a cache themselves are left to it (DeviceProfile::cache_kernels).
#pragma once

#include <CL/opencl.hpp>
#include <optional>
#include <span>
#include <string>

#include "device/hooks.hpp"
#include "device/kernel_sources.hpp"
#include "raypager/devices.hpp"
#include "raypager/status.hpp"

namespace raypager {

// The embedded source of that name with all #include "..." replaced by the texts they name, and without lines that say nothing to a compiler.
// more: sources beside the embedded ones.
Result<std::string> expand_kernel_source(const std::string& name, std::span<const KernelSource> more = {});

Result<cl::Program> build_program(const cl::Context& context, const cl::Device& device, const DeviceInfo& info, const std::string& source,
                                  const std::string& options, std::span<const KernelSource> more, DeviceHooks& hooks);

// Of a program that could be in the cache on disk and is not: the length of its text.
std::optional<size_t> missing_text(const DeviceInfo& info, const std::string& source, const std::string& options);

}  // namespace raypager
