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

// One or several: "0,1", "all", or as above.
struct DeviceChoice {
    std::vector<std::string> selectors;  // each of one device, no device twice
    std::string note;                    // what the user should know of it; empty: nothing
};
// different: devices need not be of one kind. Otherwise "all" are those like the default one, and others are refused.
Result<DeviceChoice> choose_devices(const std::string& selector, bool different, DeviceHooks& hooks);

}  // namespace raypager
