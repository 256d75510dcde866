// From what a user names to an OpenCL device.
#pragma once

#include <CL/opencl.hpp>
#include <string>
#include <vector>

#include "device/hooks.hpp"
#include "raypager/devices.hpp"

namespace raypager {

struct FoundDevice {
    DeviceInfo info;
    cl::Device device;
};

Result<std::vector<FoundDevice>> find_devices(DeviceHooks& hooks);
// An index, part of a name or platform, or empty for the default.
Result<FoundDevice> select_device(const std::string& selector, DeviceHooks& hooks);

}  // namespace raypager
