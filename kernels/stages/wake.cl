// First stage of a round: sorts all slots by what they can do now. Rays whose block is resident go into the queue, rays whose block is
// absent stay where they are (the block's wants counted them when they stopped), free slots are listed for new camera paths.
#include "lib/path.cl"
#include "lib/prefetch.cl"
#include "lib/vector.cl"
#include "raypager/abi/block.h"

#define RP_KIND_EXTEND 0u
#define RP_KIND_SHADOW 1u
#define RP_KIND_FREE 2u
#define RP_KIND_WAITING 3u
#define RP_KIND_IDLE 4u
#define RP_KIND_NONE 5u
#define RP_KINDS 5u

// What a slot in this phase can do, if it does not wait.
static inline uint rp_kind_of_phase(uint phase) {
    return phase == RP_STATUS_FREE                                        ? RP_KIND_FREE
           : phase == RP_STATUS_IDLE                                      ? RP_KIND_IDLE
           : phase == RP_STATUS_SHADOW || phase == RP_STATUS_SHADOW_WAITS ? RP_KIND_SHADOW
                                                                          : RP_KIND_EXTEND;
}

// What a slot can do.
static inline uint rp_slot_kind(const __global uint* status, const __global rp_page* pages, uint slot_count, uint slot) {
    const uint phase = status[slot] & RP_STATUS_MASK;
    const bool waits = phase >= RP_STATUS_EXTEND_WAITS && pages[rp_place_of(status, slot_count, slot)].address == RP_NONE;
    return waits ? RP_KIND_WAITING : rp_kind_of_phase(phase);
}

static inline uint rp_kind_counter(uint kind) {
    return kind == RP_KIND_EXTEND   ? RP_COUNT_EXTEND
           : kind == RP_KIND_SHADOW ? RP_COUNT_SHADOW
           : kind == RP_KIND_FREE   ? RP_COUNT_FREE
           : kind == RP_KIND_IDLE   ? RP_COUNT_IDLE
                                    : RP_COUNT_WAITING;
}

static inline uint rp_sum16(int16 v) {
    const int8 a = v.lo + v.hi;
    const int4 b = a.lo + a.hi;
    return (uint)(b.x + b.y + b.z + b.w);
}

// RP_NAP slots that all wait or are idle sleep: a ray that has waited for longer than a round waits for a block that was absent in the last
// one, so only a block that has come since can wake it, and until then nothing about these slots changes. So that they need not be looked at
// in each round, a word of theirs says how many of them wait, and for which blocks, as far as RP_NAP_BITS bits can tell (abi/path.h). It is 0
// if they do not sleep, as at the beginning of a render.
// Blocks that lie together share a bit: they come together, too.
static inline ulong rp_block_bit(uint block, uint bit_scale) { return 1ul << mul_hi(block, bit_scale); }
static inline ulong rp_asleep(uint waiting, ulong blocks) { return (ulong)(waiting + 1u) << RP_NAP_BITS | blocks; }
static inline uint rp_waiting_asleep(ulong nap) { return (uint)(nap >> RP_NAP_BITS) - 1u; }

// What is found in a run of slots. Rays that can go on are noted in a part of memory that has room for the whole run: extension rays from its
// beginning, shadow rays from its end.
#define RP_FREE_AT_ONCE 1024u
typedef struct rp_found {
    __global uint *extend, *shadow_end;
    uint extend_count, shadow_count, waiting, idle;
    uint free_count, free[RP_FREE_AT_ONCE];  // not yet listed
} rp_found;

static inline void rp_list_free(rp_found* found, __global uint* free_list, volatile __global uint* counters) {
    if (found->free_count == 0u) return;
    const uint first = atomic_add(counters + RP_COUNT_FREE, found->free_count);
    for (uint i = 0u; i < found->free_count; i++) free_list[first + i] = found->free[i];
    found->free_count = 0u;
}

// Notes a slot if there is something to do with it; if not, counts it and returns false.
static inline bool rp_find_slot(const __global uint* status, const __global rp_page* pages, uint slot_count, uint slot, __global uint* free_list,
                                volatile __global uint* counters, rp_found* found, uint bit_scale, ulong* blocks) {
    const uint kind = rp_slot_kind(status, pages, slot_count, slot);
    if (kind == RP_KIND_WAITING) {
        found->waiting++;
        *blocks |= rp_block_bit(rp_place_of(status, slot_count, slot), bit_scale);
        return false;
    }
    if (kind == RP_KIND_IDLE) {
        found->idle++;
        return false;
    }
    if (kind == RP_KIND_EXTEND) {
        found->extend[found->extend_count++] = slot;
    } else if (kind == RP_KIND_SHADOW) {
        found->shadow_end[-(int)++found->shadow_count] = slot;
    } else {
        found->free[found->free_count++] = slot;
        if (found->free_count == RP_FREE_AT_ONCE) rp_list_free(found, free_list, counters);
    }
    return true;
}

// Bundles: rays that are in the same block, or in blocks that lie together. They stand in the queue one bundle after the other, each in the order
// in which it was found, so that the rays of a stream have much in common, although those that go on are few and far between.
#define RP_LEAST_BUNDLED 128u  // fewer rays are two streams at most

static inline uint rp_bundle_of(const __global uint* status, uint slot_count, uint slot, uint bundle_scale) {
    return mul_hi(rp_place_of(status, slot_count, slot), bundle_scale);
}

// Puts the slots found[0], found[step], ... into queue[0], queue[step], ...: step is 1 for extension rays and -1 for shadow rays.
static inline void rp_list_in_bundles(const __global uint* status, uint slot_count, const __global uint* found, uint count, int step,
                                      uint bundle_scale, __global uint* queue) {
    if (count < RP_LEAST_BUNDLED) {
        for (int i = 0; i < (int)count; i++) queue[step * i] = found[step * i];
        return;
    }
    uint place[RP_BUNDLES];
    for (uint b = 0u; b < RP_BUNDLES; b++) place[b] = 0u;
    for (int i = 0; i < (int)count; i++) place[rp_bundle_of(status, slot_count, found[step * i], bundle_scale)]++;
    uint before = 0u;
    for (uint b = 0u; b < RP_BUNDLES; b++) {
        const uint size = place[b];
        place[b] = before;
        before += size;
    }
    for (int i = 0; i < (int)count; i++) {
        const uint slot = found[step * i];
        queue[step * (int)place[rp_bundle_of(status, slot_count, slot, bundle_scale)]++] = slot;
    }
}

// Looks at slots [first, end), at most RP_NAP of them, of which nobody waits for a block that has come but is not named (named not RP_NONE);
// returns their word.
static inline ulong rp_look_at_slots(const __global uint* status, const __global rp_page* pages, uint slot_count, uint first, uint end,
                                     __global uint* free_list, volatile __global uint* counters, uint bit_scale, uint named, const uint* names,
                                     rp_found* found) {
    uint look = (1u << (end - first)) - 1u;
    const uint waiting_before = found->waiting;
    ulong blocks = 0ul;
    bool all = end - first == RP_NAP;
    if (all && named != RP_NONE) {
        const uint16 phase = vload16(0, status + first) & RP_STATUS_MASK, block = vload16(0, status + RP_STATUS_WORDS(slot_count) + first);
        const int16 ends = phase == RP_STATUS_IDLE;
        int16 waits = phase >= RP_STATUS_EXTEND_WAITS;
        for (uint i = 0u; i < named; i++) waits &= block != names[i];
        const ulong16 bits = convert_ulong16(as_uint16(waits) & 1u) << convert_ulong16(mul_hi(block, (uint16)(bit_scale)));
        const ulong8 b8 = bits.lo | bits.hi;
        const ulong4 b4 = b8.lo | b8.hi;
        blocks = b4.x | b4.y | b4.z | b4.w;
        look = rp_mask16(~(waits | ends)) & 0xffffu;
        found->waiting += popcount(rp_mask16(waits));
        found->idle += popcount(rp_mask16(ends));
    }
    for (; look != 0u; look &= look - 1u)
        all &= !rp_find_slot(status, pages, slot_count, first + rp_lowest(look), free_list, counters, found, bit_scale, &blocks);
    return all ? rp_asleep(found->waiting - waiting_before, blocks) : 0ul;
}

#ifndef RP_RUNS_AT_ONCE
#define RP_RUNS_AT_ONCE 64u  // of sixteen naps each
#endif
#define RP_NAPS_AHEAD 12u  // so early a nap's slots are asked for

// Beside streams, on CPUs. A work-item looks at a run of slots, most of which sleep, and lists the others. naps: a word for each RP_NAP slots.
// bit_scale: see abi/path.h; bundle_scale: the same with RP_BUNDLES. came: the bits of the blocks that have come since the last round, or all.
// named: how many of new_blocks are their numbers, or RP_NONE if those are not all. room: a word for each slot.
__kernel void rp_wake_runs(const __global uint* restrict status, const __global rp_page* restrict pages, uint slot_count,
                           __global uint* restrict queue, __global uint* restrict free_list, volatile __global uint* restrict counters,
                           __global ulong* restrict naps, uint bit_scale, ulong came, uint named, uint16 new_blocks, uint bundle_scale,
                           __global uint* restrict room) {
    uint names[RP_MOST_NAMED];
    vstore16(new_blocks, 0, names);
    const uint nap_count = (slot_count + RP_NAP - 1u) / RP_NAP, run_count = (nap_count + 15u) / 16u;
    const uint each = (run_count + (uint)get_global_size(0) - 1u) / (uint)get_global_size(0);
    const uint first = min((uint)get_global_id(0) * each, run_count), end = min(first + each, run_count);
    rp_found found;
    found.extend = room + min(16u * RP_NAP * first, slot_count);
    found.shadow_end = room + min(16u * RP_NAP * end, slot_count);
    found.extend_count = found.shadow_count = found.waiting = found.idle = found.free_count = 0u;
    int16 sleepers = 0, naps_seen = 0;
    uint woken[16u * RP_RUNS_AT_ONCE];
    for (uint part = first; part < end; part += RP_RUNS_AT_ONCE) {
        uint count = 0u;
        for (uint run = part; run < min(part + RP_RUNS_AT_ONCE, end); run++) {
            const uint nap = 16u * run, nap_end = min(nap + 16u, nap_count);
            uint wake_up = (1u << (nap_end - nap)) - 1u;
            if (nap_end - nap == 16u) {
                const ulong16 words = vload16(0, naps + nap);
                const int16 wakes = convert_int16((words == 0ul) | ((words & came) != 0ul)), waiting = convert_int16(words >> RP_NAP_BITS) - 1;
                sleepers += wakes ? (int16)(0) : waiting;
                naps_seen -= wakes == 0;
                wake_up = rp_mask16(wakes);
            }
            for (; wake_up != 0u; wake_up &= wake_up - 1u) woken[count++] = nap + rp_lowest(wake_up);
        }
        for (uint i = 0u; i < count; i++) {
            if (i + RP_NAPS_AHEAD < count) {
                rp_fetch_early(status + RP_NAP * woken[i + RP_NAPS_AHEAD]);
                rp_fetch_early(status + RP_STATUS_WORDS(slot_count) + RP_NAP * woken[i + RP_NAPS_AHEAD]);
            }
            const uint slot = RP_NAP * woken[i];
            naps[woken[i]] = rp_look_at_slots(status, pages, slot_count, slot, min(slot + RP_NAP, slot_count), free_list, counters, bit_scale, named,
                                              names, &found);
        }
    }
    rp_list_free(&found, free_list, counters);
    if (found.extend_count != 0u)
        rp_list_in_bundles(status, slot_count, found.extend, found.extend_count, 1, bundle_scale,
                           queue + atomic_add(counters + RP_COUNT_EXTEND, found.extend_count));
    if (found.shadow_count != 0u)
        rp_list_in_bundles(status, slot_count, found.shadow_end - 1, found.shadow_count, -1, bundle_scale,
                           queue + (slot_count - 1u - atomic_add(counters + RP_COUNT_SHADOW, found.shadow_count)));
    const uint asleep = rp_sum16(sleepers), waiting = found.waiting + asleep, idle = found.idle + RP_NAP * rp_sum16(naps_seen) - asleep;
    if (waiting != 0u) atomic_add(counters + RP_COUNT_WAITING, waiting);
    if (idle != 0u) atomic_add(counters + RP_COUNT_IDLE, idle);
}

#ifdef RP_WAKE_GROUP
// Four bits a slot of a nap: what each can do. All loads of a kind are under way together: one after the other they would take most of the time.
static inline ulong rp_nap_kinds(const __global uint* status, const __global rp_page* pages, uint slot_count, uint nap, uint bit_scale,
                                 ulong* blocks) {
    const __global uint4* const at = (const __global uint4*)(status + (size_t)RP_NAP * nap);
    const __global uint4* const waited_for = at + RP_STATUS_WORDS(slot_count) / 4u;
    uint phase[RP_NAP], block[RP_NAP], address[RP_NAP];
#pragma unroll
    for (uint i = 0u; i < RP_NAP; i += 4u) {
        const uint4 four = at[i / 4u] & RP_STATUS_MASK;
        phase[i] = four.x, phase[i + 1u] = four.y, phase[i + 2u] = four.z, phase[i + 3u] = four.w;
    }
#pragma unroll
    for (uint i = 0u; i < RP_NAP; i += 4u) {
        const uint4 four = waited_for[i / 4u];
        block[i] = four.x, block[i + 1u] = four.y, block[i + 2u] = four.z, block[i + 3u] = four.w;
    }
#pragma unroll
    for (uint i = 0u; i < RP_NAP; i++) address[i] = phase[i] >= RP_STATUS_EXTEND_WAITS ? pages[block[i]].address : 0u;
    ulong kinds = 0ul;
#pragma unroll
    for (uint i = 0u; i < RP_NAP; i++) {
        const bool waits = address[i] == RP_NONE;
        if (waits) *blocks |= rp_block_bit(block[i], bit_scale);
        const uint kind = RP_NAP * nap + i >= slot_count ? RP_KIND_NONE : waits ? RP_KIND_WAITING : rp_kind_of_phase(phase[i]);
        kinds |= (ulong)kind << (4u * i);
    }
    return kinds;
}

// Of sixteen numbers of four bits, those that are `kind`: the lowest bit of each.
static inline ulong rp_of_kind(ulong kinds, uint kind) {
    const ulong ones = 0x1111111111111111ul, other = kinds ^ ones * kind;
    return ~(other | other >> 1 | other >> 2) & ones;
}
static inline uint rp_count_kind(ulong kinds, uint kind) { return (uint)popcount(rp_of_kind(kinds, kind)); }

// Free slots of which a neighbour is still in use are not given out, but count as idle for now: slots that are filled together, RP_FILLED_TOGETHER
// (2, 4 or 8), stay together, so that the stages find their states side by side. RP_FILLED_TOGETHER = 1: each slot is given out at once.
static inline ulong rp_keep_together(ulong kinds) {
#if RP_FILLED_TOGETHER > 1
    const ulong free = rp_of_kind(kinds, RP_KIND_FREE);
    const ulong unused = free | rp_of_kind(kinds, RP_KIND_IDLE) | rp_of_kind(kinds, RP_KIND_NONE);
    const ulong first = 0x1111111111111111ul & ((1ul << 4 * RP_FILLED_TOGETHER) - 1ul);
#pragma unroll
    for (uint i = 0u; i < RP_NAP / RP_FILLED_TOGETHER; i++) {
        const ulong together = first << (4u * RP_FILLED_TOGETHER * i);
        if ((unused & together) != together) kinds ^= (free & together) * (RP_KIND_FREE ^ RP_KIND_IDLE);
    }
#endif
    return kinds;
}

// Beside rays traced one by one, on GPUs. A work-group of RP_WAKE_GROUP looks at the words of RP_WAKE_NAPS times as many naps, and then, each
// work-item one after the other, at the slots of those that do not sleep.
#define RP_LISTED 3u  // kinds that are listed: EXTEND, SHADOW, FREE
__kernel void rp_wake(const __global uint* restrict status, const __global rp_page* restrict pages, uint slot_count, __global uint* restrict queue,
                      __global uint* restrict free_list, volatile __global uint* restrict counters, __global ulong* restrict naps, uint bit_scale,
                      ulong came) {
    __local uint awake[RP_WAKE_GROUP * RP_WAKE_NAPS], awake_count, count[RP_KINDS], base[RP_KINDS];
    const uint lane = get_local_id(0), nap_count = (slot_count + RP_NAP - 1u) / RP_NAP;
    for (uint kind = lane; kind < RP_KINDS; kind += RP_WAKE_GROUP) count[kind] = 0u;
    if (lane == 0u) awake_count = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint waiting = 0u, idle = 0u;
#pragma unroll
    for (uint k = 0u; k < RP_WAKE_NAPS; k++) {
        const uint i = (get_group_id(0) * RP_WAKE_NAPS + k) * RP_WAKE_GROUP + lane;
        if (i >= nap_count) continue;
        const ulong nap = naps[i];
        if (nap == 0ul || (nap & came) != 0ul) {
            awake[atomic_inc(&awake_count)] = i;
        } else {
            waiting += rp_waiting_asleep(nap);
            idle += RP_NAP - rp_waiting_asleep(nap);
        }
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    ulong kinds[RP_WAKE_NAPS];
    uint mine[RP_LISTED] = {0u, 0u, 0u};
#pragma unroll
    for (uint k = 0u; k < RP_WAKE_NAPS; k++) {
        const uint at = k * RP_WAKE_GROUP + lane;
        kinds[k] = ~0ul;
        if (at >= awake_count) continue;
        ulong blocks = 0ul;
        kinds[k] = rp_keep_together(rp_nap_kinds(status, pages, slot_count, awake[at], bit_scale, &blocks));
        const uint wait = rp_count_kind(kinds[k], RP_KIND_WAITING), end = rp_count_kind(kinds[k], RP_KIND_IDLE);
        naps[awake[at]] = wait + end == RP_NAP ? rp_asleep(wait, blocks) : 0ul;
        waiting += wait;
        idle += end;
#pragma unroll
        for (uint kind = 0u; kind < RP_LISTED; kind++) mine[kind] += rp_count_kind(kinds[k], kind);
    }
#pragma unroll
    for (uint kind = 0u; kind < RP_LISTED; kind++)
        if (mine[kind] != 0u) mine[kind] = atomic_add(&count[kind], mine[kind]);  // from now on: where this work-item's share begins
    if (waiting != 0u) atomic_add(&count[RP_KIND_WAITING], waiting);
    if (idle != 0u) atomic_add(&count[RP_KIND_IDLE], idle);
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint kind = lane; kind < RP_KINDS; kind += RP_WAKE_GROUP)
        base[kind] = count[kind] != 0u ? atomic_add(counters + rp_kind_counter(kind), count[kind]) : 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint extend = base[RP_KIND_EXTEND] + mine[RP_KIND_EXTEND], shadow = slot_count - 1u - (base[RP_KIND_SHADOW] + mine[RP_KIND_SHADOW]),
         free = base[RP_KIND_FREE] + mine[RP_KIND_FREE];
#pragma unroll
    for (uint k = 0u; k < RP_WAKE_NAPS; k++) {
        if (k * RP_WAKE_GROUP + lane >= awake_count) continue;
        const uint first = RP_NAP * awake[k * RP_WAKE_GROUP + lane];
        for (uint i = 0u; i < RP_NAP; i++) {
            const uint kind = (uint)(kinds[k] >> (4u * i)) & 15u;
            if (kind == RP_KIND_EXTEND) queue[extend++] = first + i;
            if (kind == RP_KIND_SHADOW) queue[shadow--] = first + i;
            if (kind == RP_KIND_FREE) free_list[free++] = first + i;
        }
    }
}
#endif
