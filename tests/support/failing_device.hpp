// A device that fails on purpose.
#pragma once

#include <atomic>
#include <cstdint>

#include "device/hooks.hpp"

namespace raypager::support {

// Without a fault set, it is as it is. Faults may be set while other threads use the device. A countdown of n is for the n-th from now on (1: the
// next; 0: none).
class FailingDevice : public DeviceHooks {
public:
    std::atomic<bool> no_platform{false}, no_device{false};
    std::atomic<bool> fail_builds{false};
    std::atomic<uint64_t> memory_bytes{UINT64_MAX};  // a buffer with which all of the device's would exceed this is refused
    std::atomic<int64_t> lose_in{0};                 // that command, and all after it, find the device lost
    std::atomic<int64_t> fail_pinned_in{0};          // that allocation of pinned memory fails
    std::atomic<bool> fail_pinned{false};            // all of them fail
    std::atomic<bool> hold_pinned{false};            // they wait for as long as this is set
    std::atomic<int> held_pinned{0};                 // how many wait for that
    std::atomic<bool> hold_uploads{false};           // blocks wait for as long as this is set
    // Makes good whatever was wrong: the device is there again.
    void clear();

    bool has_platforms() override { return !no_platform; }
    bool has_devices() override { return !no_device; }
    bool may_build() override { return !fail_builds; }
    bool may_allocate(uint64_t total_bytes) override { return total_bytes <= memory_bytes; }
    bool may_pin() override;
    bool may_command() override;
    void before_upload() override;

private:
    static bool counted_down(std::atomic<int64_t>& countdown) { return countdown > 0 && countdown.fetch_sub(1) == 1; }
    std::atomic<bool> lost_{false};
};

// A device whose vectors are taken to have one lane, and which traces by persistent threads all the same.
class PersistentDevice final : public DeviceHooks {
public:
    bool has_persistent_threads() override { return true; }
};

}  // namespace raypager::support
