// What kernels tell of blocks (abi/path.h, RP_DEMAND_REQUESTS and what follows).
#ifndef RP_DEMAND_CL
#define RP_DEMAND_CL

#include "raypager/abi/path.h"

static inline volatile __global uchar* rp_marks_of(volatile __global uint* demand, uint block_count) {
    return (volatile __global uchar*)(demand + RP_DEMAND_MARKS_AT((size_t)block_count));
}

// Something about the block has changed that the host is to be told.
static inline void rp_mark(volatile __global uchar* marks, uint block) {
    const uint group = block / RP_MARK_BLOCKS;
#ifdef RP_ATOMIC_MARKS
    atomic_or((volatile __global uint*)marks + group / 4u, 1u << 8u * (group % 4u));
#elif defined(RP_NV_PTX)
    marks[group] = 1u;  // a store is not waited for, but a load would be
#else
    if (marks[group] == 0u) marks[group] = 1u;  // cores that only read it do not take it from each other
#endif
}

// So many rays more wait for the block.
static inline void rp_request(volatile __global uint* demand, uint block_count, uint block, uint rays) {
    atomic_add(demand + RP_DEMAND_REQUESTS * (size_t)block_count + block, rays);
    rp_mark(rp_marks_of(demand, block_count), block);
}

// Nobody waits any more for the block.
static inline void rp_end_requests(__global uint* demand, uint block_count, uint block) {
    __global uint* const requests = demand + RP_DEMAND_REQUESTS * (size_t)block_count + block;
    if (*requests == 0u) return;
    *requests = 0u;
    rp_mark(rp_marks_of(demand, block_count), block);
}

// An extension ray ended in the block.
static inline void rp_note_bounce(volatile __global uint* demand, uint block_count, uint block) {
    atomic_inc(demand + RP_DEMAND_BOUNCES * (size_t)block_count + block);
    rp_mark(rp_marks_of(demand, block_count), block);
}

#endif
