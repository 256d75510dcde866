// What a forecast does on the device: it divides memory within a limit, and renders parts of the picture there.
#pragma once

#include <string>
#include <vector>

#include "bench/pilot.hpp"
#include "raypager/session.hpp"
#include "residency/policy.hpp"
#include "store/block_source.hpp"

namespace raypager::bench {

// What the render itself would do within its limits.
struct LimitPlan {
    std::string device;
    uint64_t pool_bytes = 0;    // for geometry
    uint64_t device_bytes = 0;  // all
    uint64_t scene_bytes = 0;   // all that pages
    uint32_t slots = 0;
    uint64_t region_pixels = 0;  // that get all their samples before the next ones begin; 0: all
    uint64_t host_bytes = 0;     // of host memory for blocks
    PolicySettings policy;
    uint32_t rounds_under_way = 1;
    bool film_in_parts = false;  // on the device
    bool holds_all() const { return pool_bytes >= scene_bytes; }
};
// Fails as the render would. nodes: that share it, each with such a device and limits.
Result<LimitPlan> plan_within(const BlockSource& source, const RenderOptions& options, uint32_t nodes = 1);
// Bytes a second from pinned memory onto the device, as loads have them.
Result<double> upload_rate(const RenderOptions& options);

struct Pilot {
    std::vector<PilotMark> marks;
    std::vector<PilotPart> parts;
    uint64_t samples = 0;       // of the whole render
    double resident_bytes = 0;  // in the end
    double seen_bytes = 0;      // of all that ever came, each once
};
// Renders parts of the picture; nobody sees it. An error of the kind "interrupted" if it was stopped.
Result<Pilot> run_pilot(const BlockSource& source, const RenderOptions& options, const RenderCallbacks& callbacks);

}  // namespace raypager::bench
