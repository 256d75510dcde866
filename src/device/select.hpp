// From what a user names to an OpenCL device.
#pragma once

#include <CL/opencl.hpp>
#include <string>
#include <vector>

#include "raypager/devices.hpp"

namespace raypager {

struct FoundDevice {
    DeviceInfo info;
    cl::Device device;
};

Result<std::vector<FoundDevice>> find_devices();
// An index, part of a name or platform, or empty for the default.
Result<FoundDevice> select_device(const std::string& selector);

}  // namespace raypager
