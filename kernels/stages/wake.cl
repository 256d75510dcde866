// First stage of a round: sorts all slots by what they can do now. Rays whose block is resident go into the queue, rays whose block is
// absent stay where they are (the block's wants counted them when they stopped), free slots are listed for new camera paths.
#include "lib/path.cl"
#include "raypager/abi/block.h"

#define RP_KIND_EXTEND 0u
#define RP_KIND_SHADOW 1u
#define RP_KIND_FREE 2u
#define RP_KIND_WAITING 3u
#define RP_KIND_IDLE 4u
#define RP_KIND_NONE 5u
#define RP_KINDS 5u

// What a slot can do.
static inline uint rp_slot_kind(const __global uint* status, const __global rp_page* pages, uint slot_count, uint slot) {
    if (slot >= slot_count) return RP_KIND_NONE;
    const uint phase = status[slot] & RP_STATUS_MASK;
    if (phase == RP_STATUS_FREE) return RP_KIND_FREE;
    if (phase == RP_STATUS_IDLE) return RP_KIND_IDLE;
    if (phase >= RP_STATUS_EXTEND_WAITS && pages[rp_waited_for(status, slot_count, slot)].address == RP_NONE) return RP_KIND_WAITING;
    return phase == RP_STATUS_SHADOW || phase == RP_STATUS_SHADOW_WAITS ? RP_KIND_SHADOW : RP_KIND_EXTEND;
}

static inline uint rp_kind_counter(uint kind) {
    return kind == RP_KIND_EXTEND   ? RP_COUNT_EXTEND
           : kind == RP_KIND_SHADOW ? RP_COUNT_SHADOW
           : kind == RP_KIND_FREE   ? RP_COUNT_FREE
           : kind == RP_KIND_IDLE   ? RP_COUNT_IDLE
                                    : RP_COUNT_WAITING;
}

// Puts slots of one kind where they belong, from place `first` on.
static inline void rp_list_slots(uint kind, const uint* slots, uint count, uint first, uint slot_count, __global uint* queue,
                                 __global uint* free_list) {
    for (uint i = 0u; i < count; i++) {
        if (kind == RP_KIND_EXTEND) queue[first + i] = slots[i];
        if (kind == RP_KIND_SHADOW) queue[slot_count - 1u - (first + i)] = slots[i];
        if (kind == RP_KIND_FREE) free_list[first + i] = slots[i];
    }
}

// PoCL's any() takes a vector apart.
static inline bool rp_any16(int16 v) {
    const int8 a = v.lo | v.hi;
    const int4 b = a.lo | a.hi;
    const int2 c = b.lo | b.hi;
    return (c.x | c.y) != 0;
}

// Whether 16 slots have nothing to do; then adds to the counts of those that wait and those that are idle. A ray that has waited for longer
// than a round waits for a block that was absent in the last one, so only a block that has come since, and is named, can wake it. False only
// says that it may be otherwise.
static inline bool rp_nothing_to_do(const __global uint* status, uint slot_count, uint first, uint named, const uint* names, int16* waiting,
                                    int16* idle) {
    const uint16 phase = vload16(0, status + first) & RP_STATUS_MASK, block = vload16(0, status + slot_count + first);
    const int16 ends = phase == RP_STATUS_IDLE;
    int16 waits = phase >= RP_STATUS_EXTEND_WAITS;
    for (uint i = 0u; i < named; i++) waits &= block != names[i];
    if (rp_any16(~(waits | ends))) return false;
    *waiting -= waits;
    *idle -= ends;
    return true;
}

static inline uint rp_sum16(int16 v) {
    const int8 a = v.lo + v.hi;
    const int4 b = a.lo + a.hi;
    return (uint)(b.x + b.y + b.z + b.w);
}

// Beside streams, on CPUs. A work-item looks at a run of slots, most of which wait, and lists the others; many at a time, so that neighbours stay
// together. named: how many of new_blocks are block numbers, or RP_NONE if not all that came are named.
#define RP_LISTED_AT_ONCE 1024u
__kernel void rp_wake_runs(const __global uint* restrict status, const __global rp_page* restrict pages, uint slot_count,
                           __global uint* restrict queue, __global uint* restrict free_list, volatile __global uint* restrict counters, uint named,
                           uint16 new_blocks) {
    uint names[RP_MOST_NAMED];
    vstore16(new_blocks, 0, names);
    const uint each = (slot_count + (uint)get_global_size(0) - 1u) / (uint)get_global_size(0);
    const uint first = min((uint)get_global_id(0) * each, slot_count), end = min(first + each, slot_count);
    int16 all_waiting = 0, all_idle = 0;
    uint waiting = 0u, idle = 0u, slots[3][RP_LISTED_AT_ONCE], count[3] = {0u, 0u, 0u};
    for (uint slot = first; slot < end; slot++) {
        if (slot % 16u == 0u && named != RP_NONE) {
            while (slot + 16u <= end && rp_nothing_to_do(status, slot_count, slot, named, names, &all_waiting, &all_idle)) slot += 16u;
            if (slot == end) break;
        }
        const uint kind = rp_slot_kind(status, pages, slot_count, slot);
        if (kind == RP_KIND_WAITING) {
            waiting++;
        } else if (kind == RP_KIND_IDLE) {
            idle++;
        } else {
            slots[kind][count[kind]++] = slot;
            if (count[kind] < RP_LISTED_AT_ONCE) continue;
            rp_list_slots(kind, slots[kind], count[kind], atomic_add(counters + rp_kind_counter(kind), count[kind]), slot_count, queue, free_list);
            count[kind] = 0u;
        }
    }
    for (uint kind = 0u; kind < 3u; kind++)
        if (count[kind] != 0u)
            rp_list_slots(kind, slots[kind], count[kind], atomic_add(counters + rp_kind_counter(kind), count[kind]), slot_count, queue, free_list);
    waiting += rp_sum16(all_waiting);
    idle += rp_sum16(all_idle);
    if (waiting != 0u) atomic_add(counters + RP_COUNT_WAITING, waiting);
    if (idle != 0u) atomic_add(counters + RP_COUNT_IDLE, idle);
}

// Beside rays traced one by one, on GPUs. A work-item looks at RP_WAKE_SLOTS slots (up to 16), a work-group at as many times its size in a row.
__kernel void rp_wake(const __global uint* restrict status, const __global rp_page* restrict pages, uint slot_count, __global uint* restrict queue,
                      __global uint* restrict free_list, volatile __global uint* restrict counters) {
    __local uint count[RP_KINDS];
    __local uint base[RP_KINDS];
    const uint lane = get_local_id(0), lanes = get_local_size(0), first = get_group_id(0) * lanes * RP_WAKE_SLOTS + lane;
    for (uint kind = lane; kind < RP_KINDS; kind += lanes) count[kind] = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    ulong kinds = 0ul;  // four bits a slot
    uint mine[RP_KINDS + 1u] = {0u, 0u, 0u, 0u, 0u, 0u};
    for (uint k = 0u; k < RP_WAKE_SLOTS; k++) {
        const uint kind = rp_slot_kind(status, pages, slot_count, first + k * lanes);
        kinds |= (ulong)kind << (4u * k);
        mine[kind]++;
    }
    for (uint kind = 0u; kind < RP_KINDS; kind++)
        if (mine[kind] != 0u) mine[kind] = atomic_add(&count[kind], mine[kind]);  // from now on: where this work-item's share begins
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint kind = lane; kind < RP_KINDS; kind += lanes)
        base[kind] = count[kind] != 0u ? atomic_add(counters + rp_kind_counter(kind), count[kind]) : 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint k = 0u; k < RP_WAKE_SLOTS; k++) {
        const uint kind = (uint)(kinds >> (4u * k)) & 15u, slot = first + k * lanes;
        if (kind == RP_KIND_EXTEND) queue[base[kind] + mine[kind]++] = slot;
        if (kind == RP_KIND_SHADOW) queue[slot_count - 1u - (base[kind] + mine[kind]++)] = slot;
        if (kind == RP_KIND_FREE) free_list[base[kind] + mine[kind]++] = slot;
    }
}
