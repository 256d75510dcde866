// Which form of the blocks a device's way of tracing needs.
#pragma once

#include "raypager/blocks.hpp"
#include "raypager/devices.hpp"
#include "raypager/status.hpp"
#include "raypager/tuning.hpp"

namespace raypager {

// instance_levels: of the scene. Streams go into one level of instances; where there are more, rays are traced one by one.
inline Status check_traversal(Traversal traversal, const DeviceInfo& device, uint32_t instance_levels) {
    if (traversal != Traversal::stream) return {};
    if (instance_levels > 1)
        return Status::usage("--traversal stream: the scene has instances of instances, which are traced one ray at a time; leave the option out");
    if (device.profile.streams) return {};
    return Status::usage("--traversal stream: " + device.name + " traces rays one by one; streams are for CPUs");
}

inline BlockForm block_form(Traversal traversal, const DeviceInfo& device, uint32_t instance_levels) {
    const bool stream = traversal == Traversal::stream || (traversal == Traversal::automatic && device.profile.streams);
    return stream && instance_levels <= 1 ? BlockForm::wide : BlockForm::stored;
}

}  // namespace raypager
