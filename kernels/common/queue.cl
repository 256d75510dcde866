// The queue of rays, and counters that work-items share (abi/path.h).
#ifndef RP_QUEUE_CL
#define RP_QUEUE_CL

#include "raypager/abi/path.h"

// One queue of slots serves both kinds of rays: extension rays from the front, shadow rays from the back.
static inline uint rp_extend_entry(const __global uint* queue, uint i) { return queue[i]; }
// Slots whose page of a texture has come fill the free list from its end.
static inline uint rp_textured_entry(const __global uint* free_list, uint slot_count, uint i) { return free_list[slot_count - 1u - i]; }
static inline uint rp_shadow_entry(const __global uint* queue, uint slot_count, uint i) { return queue[slot_count - 1u - i]; }

// Adds to a counter of 64 bits that is kept as two words.
static inline void rp_count_add(volatile __global uint* counter, uint amount) {
    if (amount == 0u) return;
    const uint before = atomic_add(counter, amount);
    if (before + amount < before) atomic_inc(counter + 1);
}

// Counts of a whole work-group on their way to global counters: one atomic a work-group instead of one a ray. Every work-item of the group
// must call both. totals: __local, `number` words.
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
