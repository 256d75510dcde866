// What follows from a scene, the options of a render and a device, before anything is made on the device.
#pragma once

#include "device/device_list.hpp"
#include "raypager/abi/scene.h"
#include "render/checkpoint.hpp"
#include "render/memory_plan.hpp"
#include "render/render.hpp"
#include "residency/policy.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {

// All but slot_count and first_sample.
Result<rp_render_params> make_params(const BakedScene& scene, const RenderOptions& options);
RenderIdentity identity_of(const BakedScene& scene, const rp_render_params& params);
// The film lies in one buffer on the device; the finished picture lies in host memory.
Status check_picture_size(const rp_render_params& params, const DeviceInfo& device);

// Whether a render that is long enough goes region by region (RenderOptions::region) by itself. Not if the time decides how many samples there are,
// or pictures are looked at before the end.
bool chooses_region(const RenderOptions& options);
// About options.record_paths of all paths, and room for what they log in an ordinary round; in others, some rays wait for the next one.
VisitLogSettings visit_log_settings(const BakedScene& scene, const RenderOptions& options, const rp_render_params& params, const DeviceInfo& device);
// How blocks lie on the device. Visits can be recorded only of rays that are traced one by one.
BlockForm block_form(const RenderOptions& options, const DeviceInfo& device);
// device_limit: of all device memory, in bytes. A pool in host memory is not among the needs.
MemoryNeeds memory_needs(const BakedScene& scene, BlockForm form, const RenderOptions& options, const rp_render_params& params,
                         const VisitLogSettings& visits, const DeviceInfo& device, uint64_t device_limit);
// Pixels of a region, if the render chooses it; 0: there are none. order: without regions.
uint32_t chosen_region(const rp_sample_order& order, const MemoryPlan& plan, const MemoryNeeds& needs, uint64_t pixels);
// Path slots that are given out at once with single rays: the more, the more states lie side by side where stages read them, but a ray that waits
// keeps its neighbours from being used. To begin with:
uint32_t filled_together(const rp_sample_order& order, const MemoryPlan& plan, const MemoryNeeds& needs);
// The same where blocks are swapped in a render that goes region by region: the more often an extension ray has waited so far, the fewer.
uint32_t filled_together(double waits_per_ray);
// What the policy wants to know of blocks.
BlockNotes block_notes(PolicyKind policy);
PolicySettings policy_settings(const BakedScene& scene, BlockForm form, const RenderOptions& options, uint64_t pool_bytes, const DeviceInfo& device);
// Of a pool that holds all geometry, and what slabs leave over at their ends.
uint64_t whole_pool_bytes(const BakedScene& scene, BlockForm form, const DeviceInfo& device);
// The user's, or half of all memory, for the cache of blocks; less if less is free. planned_bytes: of device memory, which a CPU takes out of it.
uint64_t host_limit(const RenderOptions& options, const DeviceInfo& device, uint64_t planned_bytes);

}  // namespace raypager
