// Which form of the blocks a device's way of tracing needs.
#pragma once

#include "raypager/blocks.hpp"
#include "raypager/devices.hpp"
#include "raypager/status.hpp"
#include "raypager/tuning.hpp"

namespace raypager {

inline Status check_traversal(Traversal traversal, const DeviceInfo& device) {
    if (traversal != Traversal::stream || device.profile.streams) return {};
    return Status::usage("--traversal stream: " + device.name + " traces rays one by one; streams are for CPUs");
}

inline BlockForm block_form(Traversal traversal, const DeviceInfo& device) {
    const bool stream = traversal == Traversal::stream || (traversal == Traversal::automatic && device.profile.streams);
    return stream ? BlockForm::wide : BlockForm::stored;
}

}  // namespace raypager
