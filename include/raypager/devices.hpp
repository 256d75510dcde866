// Which OpenCL devices there are.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "raypager/device_profile.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct DeviceInfo {
    uint32_t index = 0;  // as in --device N
    std::string name, platform, driver;
    DeviceType type = DeviceType::accelerator;
    uint64_t memory_bytes = 0, max_allocation_bytes = 0;
    uint32_t compute_units = 0;
    DeviceProfile profile;    // of its class; of an open device with what the user changed
    bool is_default = false;  // what RAYPAGER_DEVICE names; if it is not set, a GPU before a CPU
    uint32_t cpu_cores() const { return type == DeviceType::cpu ? compute_units : 0; }
};

// The environment variable that names the device to take where no option does: as in --device.
inline constexpr const char* default_device_variable = "RAYPAGER_DEVICE";

// Fails with a sentence that says what to install if there is no platform or no device.
Result<std::vector<DeviceInfo>> list_devices();

}  // namespace raypager
