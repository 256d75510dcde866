// How rays are traced: one a work-item (GPUs), or 64 of them in a stream (CPUs); each wants its own form of the blocks.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "block/baked_scene.hpp"
#include "device/device_list.hpp"
#include "raypager/status.hpp"

namespace raypager {

enum class Traversal { automatic, ray, stream };

struct TraversalName {
    Traversal traversal;
    std::string_view name;
};
inline constexpr std::array<TraversalName, 3> traversal_names = {
    {{Traversal::automatic, "auto"}, {Traversal::ray, "ray"}, {Traversal::stream, "stream"}}};

constexpr std::optional<Traversal> traversal_from_name(std::string_view name) {
    for (const TraversalName& entry : traversal_names)
        if (entry.name == name) return entry.traversal;
    return std::nullopt;
}

inline Status check_traversal(Traversal traversal, const DeviceInfo& device) {
    if (traversal != Traversal::stream || device.profile.streams) return {};
    return Status::usage("--traversal stream: " + device.name + " traces rays one by one; streams are for CPUs");
}

inline BlockForm block_form(Traversal traversal, const DeviceInfo& device) {
    const bool stream = traversal == Traversal::stream || (traversal == Traversal::automatic && device.profile.streams);
    return stream ? BlockForm::wide : BlockForm::stored;
}

}  // namespace raypager
