// Devices that fail on purpose, for tests. Without a fault set, an operation costs one look at a variable more.
#pragma once

#include <atomic>
#include <cstdint>

namespace raypager {

struct DeviceFaults {
    std::atomic<bool> no_platform{false}, no_device{false};
    std::atomic<bool> fail_builds{false};            // of kernels; binaries from the cache do not load either
    std::atomic<uint64_t> memory_bytes{UINT64_MAX};  // a buffer with which all of the process's would exceed this is refused
    std::atomic<int64_t> lose_in{0};                 // the n-th command from now on, and all after it, find the device lost; 0: none
    std::atomic<int64_t> fail_pinned_in{0};          // the n-th allocation of pinned memory from now on fails; 0: none
    std::atomic<bool> lost{false};                   // set by lose_in
    std::atomic<bool> hold_uploads{false};           // writes to the upload queue wait for as long as this is set
    // No faults, but what this device would not do by itself: persistent threads (with vectors of one lane), a cache of kernels although its
    // driver has one.
    std::atomic<bool> persistent_threads{false}, cache_kernels{false};
    std::atomic<uint32_t> visit_events{0};  // that the log of visits has room for; 0: as many as it should
    void clear();
};
DeviceFaults& device_faults();

}  // namespace raypager
