#include "device/faults.hpp"

namespace raypager {

DeviceFaults& device_faults() {
    static DeviceFaults faults;
    return faults;
}

void DeviceFaults::clear() {
    no_platform = no_device = fail_builds = lost = hold_uploads = persistent_threads = cache_kernels = false;
    memory_bytes = UINT64_MAX;
    lose_in = fail_pinned_in = 0;
    visit_events = 0;
}

}  // namespace raypager
