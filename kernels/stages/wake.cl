// First stage of a round: sorts all slots by what they can do now. Rays whose block is resident go into the queue, rays whose block is
// absent are counted as wants of that block, free slots are listed for new camera paths.
#include "lib/path.cl"
#include "raypager/abi/block.h"

#define RP_KIND_EXTEND 0u
#define RP_KIND_SHADOW 1u
#define RP_KIND_FREE 2u
#define RP_KIND_WAITING 3u
#define RP_KIND_IDLE 4u
#define RP_KINDS 5u

__kernel void rp_wake(const __global uint* restrict status, const __global uint4* restrict paths, const __global rp_portal* restrict portals,
                      const __global rp_page* restrict pages, uint slot_count, __global uint* restrict queue, __global uint* restrict free_list,
                      volatile __global uint* restrict counters, volatile __global uint* restrict demand) {
    __local uint count[RP_KINDS];
    __local uint base[RP_KINDS];
    const uint lane = get_local_id(0), slot = get_global_id(0);
    if (lane < RP_KINDS) count[lane] = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint kind = RP_KINDS, rank = 0u;
    if (slot < slot_count) {
        const uint phase = status[slot] & RP_STATUS_MASK;
        if (phase == RP_STATUS_FREE) {
            kind = RP_KIND_FREE;
        } else if (phase == RP_STATUS_IDLE) {
            kind = RP_KIND_IDLE;
        } else {
            kind = phase == RP_STATUS_SHADOW ? RP_KIND_SHADOW : RP_KIND_EXTEND;
            const uint portal = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot).w;
            if (portal != RP_NONE) {
                const uint block = portals[portal].block;
                if (pages[block].address == RP_NONE) {
                    kind = RP_KIND_WAITING;
                    atomic_inc(demand + block);
                }
            }
        }
        rank = atomic_inc(&count[kind]);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (lane < RP_KINDS && count[lane] != 0u) {
        const uint counter = lane == RP_KIND_EXTEND   ? RP_COUNT_EXTEND
                             : lane == RP_KIND_SHADOW ? RP_COUNT_SHADOW
                             : lane == RP_KIND_FREE   ? RP_COUNT_FREE
                             : lane == RP_KIND_IDLE   ? RP_COUNT_IDLE
                                                      : RP_COUNT_WAITING;
        base[lane] = atomic_add(counters + counter, count[lane]);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (kind == RP_KIND_EXTEND) queue[base[kind] + rank] = slot;
    if (kind == RP_KIND_SHADOW) queue[slot_count - 1u - (base[kind] + rank)] = slot;
    if (kind == RP_KIND_FREE) free_list[base[kind] + rank] = slot;
}
