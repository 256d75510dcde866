// What a forecast does on the device: it divides memory within a limit, and renders parts of the picture there.
#pragma once

#include <string>
#include <vector>

#include "bench/pilot.hpp"
#include "raypager/session.hpp"
#include "store/block_source.hpp"

namespace raypager::bench {

// What the render itself would do within its limits.
struct LimitPlan {
    std::string device;
    uint64_t pool_bytes = 0;    // for geometry
    uint64_t device_bytes = 0;  // all
    uint64_t scene_bytes = 0;   // all that pages
    uint32_t slots = 0;
    bool holds_all() const { return pool_bytes >= scene_bytes; }
};
// Fails as the render would.
Result<LimitPlan> plan_within(const BlockSource& source, const RenderOptions& options);

struct Pilot {
    std::vector<PilotMark> marks;
    std::vector<PilotPart> parts;
    uint64_t samples = 0;       // of the whole render
    double resident_bytes = 0;  // in the end
};
// Renders parts of the picture; nobody sees it. An error of the kind "interrupted" if it was stopped.
Result<Pilot> run_pilot(const BlockSource& source, const RenderOptions& options, const RenderCallbacks& callbacks);

}  // namespace raypager::bench
