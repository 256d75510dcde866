// How a scene is rendered on one device. Here all options are resolved that leave something to choose; what comes after reads the plan.
#pragma once

#include "raypager/abi/scene.h"
#include "raypager/devices.hpp"
#include "render/memory_plan.hpp"
#include "render/render.hpp"
#include "residency/residency.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {

struct RenderPlan {
    rp_render_params params;  // slot_count, region and rows of the film included
    BlockForm form = BlockForm::stored;
    VisitLogSettings visits;
    BlockNotes notes;  // that the policy needs
    ResidencySettings residency;
    uint64_t host_limit = 0;        // bytes of host memory for blocks
    uint64_t device_bytes = 0;      // of the plan
    uint32_t filled_together = 1;   // path slots that are given out at once, with single rays
    bool fills_by_waits = false;    // filled_together follows how often rays wait
    uint32_t rounds_under_way = 1;  // at most
};
// Who shares the work, this one included.
struct Sharers {
    uint32_t devices = 1;      // equal ones, on this machine
    uint32_t all_devices = 1;  // on all machines
    uint32_t processes = 1;    // on this machine
    uint64_t host_limit = 0;   // in bytes, for each process, where that is settled already; else 0
};

// memory_limit: of all device memory, in bytes.
Result<RenderPlan> plan_render(const BakedScene& scene, const RenderOptions& options, const RenderInstruments& instruments,
                               const rp_render_params& params, const DeviceInfo& device, uint64_t memory_limit, const Sharers& sharers = {});
// Whether the film may be on the device in parts (render/film_windows.hpp): not where all of it is looked at before the end, or several share it.
bool may_take_windows(const RenderOptions& options, const RenderInstruments& instruments, const rp_render_params& params, const Sharers& sharers);
// The user's, or of half of all memory a share, for the cache of blocks; less if less is free. planned_bytes: of device memory, which a CPU takes
// out of it. processes: on this machine. film_bytes: of a film in main memory.
uint64_t host_limit(const RenderOptions& options, const DeviceInfo& device, uint64_t planned_bytes, uint32_t processes, uint64_t film_bytes = 0);

// What the policy needs to know of blocks.
BlockNotes block_notes(PolicyKind policy);
// Pixels of a region, if the render chooses it; 0: there are none. order: without regions.
uint32_t chosen_region(const rp_sample_order& order, const MemoryPlan& plan, const MemoryNeeds& needs, uint64_t pixels);
// Path slots that are given out at once with single rays: the more, the more states lie side by side where stages read them, but a ray that waits
// keeps its neighbours from being used. To begin with:
uint32_t filled_together(const rp_sample_order& order, const MemoryPlan& plan, const MemoryNeeds& needs);
// The same where blocks are swapped in a render that goes region by region: the more often an extension ray has waited so far, the fewer.
uint32_t filled_together(double waits_per_ray);

}  // namespace raypager
