// Access to path slots, queues and counters (abi/path.h).
#ifndef RP_PATH_CL
#define RP_PATH_CL

#include "lib/prefetch.cl"
#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"

#define RP_PLANE(paths, plane, slot_count, slot) (paths)[RP_PLANE_INDEX(plane, (size_t)(slot_count), slot)]

// Asks for a slot's planes, which are about to be read.
static inline void rp_fetch_path(const __global uint4* paths, uint slot_count, uint slot) {
    for (uint plane = 0u; plane < RP_PATH_PLANES; plane += 2u) rp_fetch_early(&RP_PLANE(paths, plane, slot_count, slot));
}

// The same of what an extension ray is read from and written to.
static inline void rp_fetch_extension(const __global uint4* paths, uint slot_count, uint slot) {
    rp_fetch_early(&RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot));
    rp_fetch_early(&RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot));
}

// One queue of slots serves both kinds of rays: extension rays from the front, shadow rays from the back.
static inline uint rp_extend_entry(const __global uint* queue, uint i) { return queue[i]; }
static inline uint rp_shadow_entry(const __global uint* queue, uint slot_count, uint i) { return queue[slot_count - 1u - i]; }

static inline uint rp_state_offset(uint state) { return state >> RP_STATUS_OFFSET_SHIFT & RP_STATUS_OFFSET_MASK; }
// Beside streams: of a block in the status word.
static inline uint rp_block_state(uint block) { return min(block, ~0u >> RP_STATUS_BLOCK_SHIFT) << RP_STATUS_BLOCK_SHIFT; }

// See abi/path.h.
static inline uint rp_place_of(const __global uint* status, uint slot_count, uint slot) { return status[(size_t)RP_STATUS_WORDS(slot_count) + slot]; }
static inline void rp_set_place(__global uint* status, uint slot_count, uint slot, uint place) {
    status[(size_t)RP_STATUS_WORDS(slot_count) + slot] = place;
}

#ifdef RP_VERTEX_COLORS
static inline uint rp_color_of(const __global uint* status, uint slot_count, uint slot) {
    return status[2u * (size_t)RP_STATUS_WORDS(slot_count) + slot];
}
static inline void rp_set_color(__global uint* status, uint slot_count, uint slot, uint color) {
    status[2u * (size_t)RP_STATUS_WORDS(slot_count) + slot] = color;
}
#endif

// What a shadow ray brings if it arrives, from its planes.
static inline float3 rp_light_in(uint4 hit, uint4 surface) { return (float3)(as_float(hit.w), as_float(surface.x), as_float(surface.y)); }

// Where a ray will go on.
static inline void rp_set_portal(uint slot, uint portal, uint slot_count, __global uint4* paths) {
    ((__global uint*)&RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot))[3] = portal;
}

// The ray of a slot waits for a block. wants: of all blocks. state: RP_STATUS_*_WAITS, and what else the status word has to say.
static inline void rp_wait_for(uint slot, uint block, uint state, uint slot_count, __global uint* status, volatile __global uint* wants) {
    status[slot] = state;
    rp_set_place(status, slot_count, slot, block);
    atomic_inc(wants + block);
}

// Adds to a counter of 64 bits that is kept as two words.
static inline void rp_count_add(volatile __global uint* counter, uint amount) {
    if (amount == 0u) return;
    const uint before = atomic_add(counter, amount);
    if (before + amount < before) atomic_inc(counter + 1);
}

// Counts of a whole work-group on their way to global counters: one atomic a work-group instead of one a ray. Every work-item of the group
// must come by both. totals: __local, `number` words.
static inline void rp_begin_totals(__local uint* totals, uint number) {
    for (uint i = get_local_id(0); i < number; i += get_local_size(0)) totals[i] = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
}
static inline void rp_add_totals(__local uint* totals, const uint* mine, uint number, volatile __global uint* counters) {
    for (uint i = 0u; i < number; i++)
        if (mine[i] != 0u) atomic_add(totals + i, mine[i]);
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint i = get_local_id(0); i < number; i += get_local_size(0)) rp_count_add(counters + 2u * i, totals[i]);
}

#endif
