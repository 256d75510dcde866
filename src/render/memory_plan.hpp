// How the memory limit is divided between what must be there, path slots and the geometry pool. Pure arithmetic.
#pragma once

#include <algorithm>
#include <cstdint>

#include "raypager/status.hpp"

namespace raypager {

struct MemoryNeeds {
    uint64_t limit = 0;      // all device memory
    uint64_t fixed = 0;      // scene tables, page table
    uint64_t film = 0;       // of the whole picture
    uint64_t film_part = 0;  // the film can be there part by part, each a multiple of this; 0: it cannot
    uint64_t per_slot = 0;   // bytes of a path slot
    uint64_t geometry = 0;   // all blocks, pages of images among them
    uint64_t largest_block = 0;
    uint64_t geometry_limit = 0;        // the user's; 0: none
    double geometry_limit_percent = 0;  // the user's; 0: none
    uint64_t requested_slots = 0;       // the user's; 0: choose
    uint64_t default_slots = 0;         // that keep the device busy
    uint64_t preferred_slots = 0;       // that suit it better, where all geometry fits beside them
    uint64_t max_chosen_slots = 0;      // where blocks must be swapped and there is room: so many at most, ...
    uint64_t max_slot_bytes = 0;        // ... and so many bytes of them
    uint64_t cached_slots = 0;          // that fit the caches of a CPU; there are more only where loads dominate; 0: caches do not matter (GPUs)
    double slots_for_loads = 0;         // with cached_slots: bytes of slots, in bytes of the scene over the share of it that is resident
    uint64_t total_paths = 0;           // of the whole render
    uint64_t max_region_slots = 0;      // with at most so many the render goes region by region (RenderTuning::region); 0: it does not
    uint64_t max_slots = UINT64_MAX;    // that the device can hold in one buffer
    uint64_t max_film = UINT64_MAX;     // bytes that the device can hold in one buffer
    bool whole_film = false;            // wherever it fits
};

struct MemoryPlan {
    uint64_t pool_bytes = 0;
    uint64_t slots = 0;
    uint64_t film_bytes = 0;
};

// Whether nothing ever has to leave.
inline bool holds_all(const MemoryPlan& plan, const MemoryNeeds& needs) { return plan.pool_bytes >= needs.geometry; }

// The fewest slots that a plan chooses by itself.
inline constexpr uint64_t min_slots = 1024;

// Pool and slots within the limit. Refuses what does not fit with a sentence that names the smallest limit that would do.
//
// The film is there as a whole, unless it is larger than the device's largest buffer, or takes more than half of what is left beside the fixed part
// and more than pool and slots have no use for: then in parts, as few as possible of which none takes more than a quarter or what is spare.
//
// The pool gets what the geometry limit allows, at most all geometry. Slots: enough to keep the device busy if everything is resident, and
// the preferred number of them as far as everything stays resident. When blocks must be swapped, every ray in flight makes a load serve more rays
// (bytes moved a ray fall as 1 / slots) and a round fuller, so there may be more. Where that is taken from the pool: on a GPU up to the preferred
// number, else up to a sixth of the scene's bytes and four times the ordinary number. Of room that the pool may not have: up to half of the scene's
// bytes, or a quarter up to max_slot_bytes. On a CPU more slots than its caches hold are dearer to read, so there are more than cached_slots only as
// far as loads are dearer: in proportion to the scene's bytes, and inversely to the share of it that is resident. Renders that go region by region
// meet fewer blocks at a time, and half of these slots, on a CPU twice cached_slots at least where regions are left then, are better: there is less
// to look at and to fetch from far. Always at most half of what is left beside the fixed part if the pool could use the other half, a quarter of all
// paths of the render, and so many that slots and pool together are no more than they would be with everything resident.
Result<MemoryPlan> plan_memory(const MemoryNeeds& needs);

}  // namespace raypager
