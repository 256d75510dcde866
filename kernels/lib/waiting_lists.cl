// Rays that wait beside streams: lists of their slots, for each block (abi/path.h).
#ifndef RP_WAITING_LISTS_CL
#define RP_WAITING_LISTS_CL

#include "lib/path.cl"

// The lists of a block's extension or shadow rays that wait. demand: abi/path.h.
static inline volatile __global rp_list* rp_lists_of(volatile __global uint* demand, uint block_count, uint block, bool shadow) {
    volatile __global rp_list* const lists = (volatile __global rp_list*)(demand + (size_t)RP_DEMAND_LISTS * block_count);
    return lists + (size_t)block * (2u * RP_LISTS) + (shadow ? RP_LISTS : 0u);
}

// The same as rp_wait_for beside streams, where the slot goes to the front of a list of the block's. stream: number of the ray's.
static inline void rp_wait_in_list(uint slot, uint stream, uint block, uint state, uint slot_count, __global uint* status,
                                   volatile __global uint* demand, uint block_count) {
    volatile __global rp_list* const list = rp_lists_of(demand, block_count, block, (state & RP_STATUS_MASK) == RP_STATUS_SHADOW_WAITS) + stream % RP_LISTS;
    status[slot] = state;
    rp_set_place(status, slot_count, slot, atomic_xchg(&list->link, slot + 1u));
    atomic_inc(&list->count);
    atomic_inc(demand + RP_DEMAND_WANTS * block_count + block);
}

#endif
