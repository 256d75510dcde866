// Rays a second of the engine's own tracing stages, on rays that lie on the device: the top tree, the blocks and the hops between them
// are in, and surfaces at hits where the stage `extend` finds them (in streams); everything is resident. Path slots are filled with the
// rays, and the stages `extend` and `connect` are launched on them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "raypager/device_profile.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "store/block_file.hpp"
#include "wavefront/block_form.hpp"

namespace raypager::bench {

struct TraverseOptions {
    std::string device;
    uint64_t memory_limit = 0;  // 0: Device::default_limit
    ProfileChanges tuning;      // of what suits the device
    uint32_t width = 1024, height = 1024;
    std::optional<Camera> camera;                      // default: the scene's
    std::optional<std::pair<Float3, Float3>> light;    // box that shadow rays end in; default: above the scene
    std::optional<std::pair<Float3, Float3>> ceiling;  // where camera rays that miss end; default: they have no bounce and no shadow ray
    uint32_t repeats = 5;
    Traversal traversal = Traversal::automatic;
};

struct RaySetResult {
    std::string name;  // "primary", "diffuse", "shadow"
    uint64_t rays = 0, hits = 0;
    std::vector<double> seconds;  // on the device, one a repeat
    double median_seconds() const;
    double rays_per_second() const { return static_cast<double>(rays) / median_seconds(); }
};

struct TraverseResult {
    std::string device;
    double bytes_per_primitive = 0;  // of device memory, without the top tree
    std::vector<RaySetResult> sets;
};

// The box of light of `bench traverse`: above the scene, where a sun or a lamp would be.
std::pair<Float3, Float3> default_light(const BakedScene& scene);

Result<TraverseResult> measure_traversal(const BlockFile& file, const TraverseOptions& options);

}  // namespace raypager::bench
