// Which form of the blocks a device's way of tracing needs.
#pragma once

#include "raypager/blocks.hpp"
#include "raypager/devices.hpp"
#include "raypager/status.hpp"
#include "raypager/tuning.hpp"

namespace raypager {

// instances: whether the scene has any, which are traced one ray at a time.
inline Status check_traversal(Traversal traversal, const DeviceInfo& device, bool instances) {
    if (traversal != Traversal::stream) return {};
    if (instances) return Status::usage("--traversal stream: the scene has instances, which are traced one ray at a time; leave the option out");
    if (device.profile.streams) return {};
    return Status::usage("--traversal stream: " + device.name + " traces rays one by one; streams are for CPUs");
}

inline BlockForm block_form(Traversal traversal, const DeviceInfo& device, bool instances) {
    const bool stream = traversal == Traversal::stream || (traversal == Traversal::automatic && device.profile.streams);
    return stream && !instances ? BlockForm::wide : BlockForm::stored;
}

}  // namespace raypager
