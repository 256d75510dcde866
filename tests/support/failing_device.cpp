#include "support/failing_device.hpp"

#include <chrono>
#include <thread>

namespace raypager::support {

void FailingDevice::clear() {
    no_platform = no_device = fail_builds = fail_pinned = hold_pinned = hold_uploads = lost_ = false;
    memory_bytes = UINT64_MAX;
    lose_in = fail_pinned_in = 0;
}

bool FailingDevice::may_pin() {
    const bool fails = counted_down(fail_pinned_in);
    ++held_pinned;
    while (hold_pinned) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    --held_pinned;
    return !fails && !fail_pinned;
}

bool FailingDevice::may_command() {
    if (counted_down(lose_in)) lost_ = true;
    return !lost_;
}

void FailingDevice::before_upload() {
    while (hold_uploads) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace raypager::support
