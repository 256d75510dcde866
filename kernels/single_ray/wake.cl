// First stage of a round, beside rays traced one by one, as on GPUs: sorts all slots by what they can do now. Rays whose block is resident go into
// the queue, rays whose block is absent stay where they are (the block's requests counted them when they stopped), free slots are listed for new
// camera paths.
#include "common/bits.cl"
#include "common/path_state.cl"
#include "raypager/abi/block.h"

// What a slot can do. Rays from the first vertex of their path come first in their queues, as far as one work-group fills these: their
// neighbours are rays from neighbouring points, so that work-items which trace them together go the same way (shadow rays - 9 % on an H100).
#define RP_KIND_FIRST_EXTEND 0u
#define RP_KIND_EXTEND 1u
#define RP_KIND_FIRST_SHADOW 2u
#define RP_KIND_SHADOW 3u
#define RP_KIND_FREE 4u
#ifdef RP_TEXTURES
#define RP_KIND_TEXTURED 5u  // the page of a texture has come that the slot waited for
#define RP_LISTED_KINDS 6u
#define RP_LISTS_FILLED 5u
#else
#define RP_LISTED_KINDS 5u
#define RP_LISTS_FILLED 4u
#endif
// Queues of extension rays and of shadow rays, two kinds in each; free list; those that wait, which are only counted; and slots whose page has come.
#define RP_KIND_WAITING RP_LISTED_KINDS
#define RP_COUNTED_KINDS (RP_LISTED_KINDS + 1u)
#define RP_KIND_IDLE (RP_LISTED_KINDS + 1u)
#define RP_KIND_NONE (RP_LISTED_KINDS + 2u)

// What a slot with this status word can do, if it does not wait.
static inline uint rp_kind_of_status(uint status) {
    if (rp_is_free(status)) return RP_KIND_FREE;
    if (rp_is_idle(status)) return RP_KIND_IDLE;
#ifdef RP_TEXTURES
    if (rp_waits_to_shade(status)) return RP_KIND_TEXTURED;
#endif
    const uint kind = rp_has_shadow_ray(status) ? RP_KIND_SHADOW : RP_KIND_EXTEND;
    return rp_leaves_first_vertex(status) ? kind - 1u : kind;
}

static inline uint rp_list_total(const __local uint* count, uint list) {
    return list == 0u   ? count[RP_KIND_FIRST_EXTEND] + count[RP_KIND_EXTEND]
           : list == 1u ? count[RP_KIND_FIRST_SHADOW] + count[RP_KIND_SHADOW]
           : list == 2u ? count[RP_KIND_FREE]
#ifdef RP_TEXTURES
           : list == 4u ? count[RP_KIND_TEXTURED]
#endif
                        : count[RP_KIND_WAITING];
}
static inline uint rp_list_counter(uint list) {
    return list == 0u   ? RP_COUNT_EXTEND
           : list == 1u ? RP_COUNT_SHADOW
           : list == 2u ? RP_COUNT_FREE
           : list == 3u ? RP_COUNT_WAITING
                        : RP_COUNT_TEXTURED;
}

// RP_SLEEP_GROUP slots that all wait or are idle sleep: a ray that has waited for longer than a round waits for a block that was absent in the last
// one, so only a block that has come since can wake it, and until then nothing about these slots changes. So that they need not be looked at
// in each round, a word of theirs says how many of them wait, and for which blocks, as far as RP_SLEEP_BITS bits can tell (abi/path.h). It is 0
// if they do not sleep, as at the beginning of a render.
// Blocks that lie together share a bit: they come together, too.
static inline ulong rp_block_bit(uint block, uint bit_scale) { return 1ul << mul_hi(block, bit_scale); }
static inline ulong rp_asleep(uint waiting, ulong blocks) { return (ulong)(waiting + 1u) << RP_SLEEP_BITS | blocks; }
static inline uint rp_waiting_asleep(ulong sleep_group) { return (uint)(sleep_group >> RP_SLEEP_BITS) - 1u; }

// Four bits a slot of a sleeping group: what each can do. All loads of a kind are under way together: one after the other they would take most of the
// time.
static inline ulong rp_sleep_group_kinds(const __global uint* statuses, const __global rp_page* pages, uint slot_count, uint sleep_group,
                                         uint bit_scale, ulong* blocks) {
    const __global uint4* const at = (const __global uint4*)(statuses + (size_t)RP_SLEEP_GROUP * sleep_group);
    const __global uint4* const waited_for = (const __global uint4*)(rp_wait_words(statuses, slot_count) + (size_t)RP_SLEEP_GROUP * sleep_group);
    uint status[RP_SLEEP_GROUP], block[RP_SLEEP_GROUP], address[RP_SLEEP_GROUP];
#pragma unroll
    for (uint i = 0u; i < RP_SLEEP_GROUP; i += 4u) {
        const uint4 four = at[i / 4u];
        status[i] = four.x, status[i + 1u] = four.y, status[i + 2u] = four.z, status[i + 3u] = four.w;
    }
#pragma unroll
    for (uint i = 0u; i < RP_SLEEP_GROUP; i += 4u) {
        const uint4 four = waited_for[i / 4u];
        block[i] = four.x, block[i + 1u] = four.y, block[i + 2u] = four.z, block[i + 3u] = four.w;
    }
#pragma unroll
    for (uint i = 0u; i < RP_SLEEP_GROUP; i++) address[i] = rp_awaited_address(pages, status[i], block[i]);
    ulong kinds = 0ul;
#pragma unroll
    for (uint i = 0u; i < RP_SLEEP_GROUP; i++) {
        const bool waits = address[i] == RP_NONE;
        if (waits) *blocks |= rp_block_bit(block[i], bit_scale);
        const uint kind = RP_SLEEP_GROUP * sleep_group + i >= slot_count ? RP_KIND_NONE : waits ? RP_KIND_WAITING : rp_kind_of_status(status[i]);
        kinds |= (ulong)kind << (4u * i);
    }
    return kinds;
}

// Of sixteen numbers of four bits, those that are `kind`: the lowest bit of each.
static inline ulong rp_of_kind(ulong kinds, uint kind) {
    const ulong ones = 0x1111111111111111ul, other = kinds ^ ones * kind;
#ifdef RP_TEXTURES
    return ~(other | other >> 1 | other >> 2 | other >> 3) & ones;
#else
    return ~(other | other >> 1 | other >> 2) & ones;  // there are eight kinds
#endif
}
static inline uint rp_count_kind(ulong kinds, uint kind) { return (uint)popcount(rp_of_kind(kinds, kind)); }

// Free slots of which a neighbour is still in use are not given out, but count as idle for now: slots that are filled together (1, 2, 4 or 8)
// stay together, so that the stages find their planes side by side.
static inline ulong rp_keep_together(ulong kinds, uint together) {
    const ulong free = rp_of_kind(kinds, RP_KIND_FREE);
    ulong unused = free | rp_of_kind(kinds, RP_KIND_IDLE) | rp_of_kind(kinds, RP_KIND_NONE);
    // Each step halves how many there are of what is all unused, and tells it to both halves.
    if (together >= 2u) unused = (unused & unused >> 4 & 0x0101010101010101ul) * 0x11ul;
    if (together >= 4u) unused = (unused & unused >> 8 & 0x0001000100010001ul) * 0x1111ul;
    if (together >= 8u) unused = (unused & unused >> 16 & 0x0000000100000001ul) * 0x11111111ul;
    return kinds ^ (free & ~unused) * (RP_KIND_FREE ^ RP_KIND_IDLE);
}

// Lists sleeping groups that are awake, of those that a work-group looks at, for all its work-items. Returns how many rays wait in this one's others.
static inline uint rp_find_awake(const __global ulong* sleep_groups, uint sleep_group_count, ulong came, __local uint* awake,
                                 __local uint* awake_count) {
    uint waiting = 0u;
#pragma unroll
    for (uint k = 0u; k < RP_WAKE_SLEEP_GROUPS; k++) {
        const uint i = (get_group_id(0) * RP_WAKE_SLEEP_GROUPS + k) * RP_WAKE_GROUP + get_local_id(0);
        if (i >= sleep_group_count) continue;
        const ulong sleep_group = sleep_groups[i];
        if (sleep_group == 0ul || (sleep_group & came) != 0ul)
            awake[atomic_inc(awake_count)] = i;
        else
            waiting += rp_waiting_asleep(sleep_group);
    }
    return waiting;
}

// A work-group of RP_WAKE_GROUP looks at the words of RP_WAKE_SLEEP_GROUPS times as many sleeping groups, and then, each
// work-item one after the other, at the slots of those that do not sleep. Those loops are not unrolled: four times the code takes three times as long
// to compile, and is no faster.
__kernel void rp_wake(const __global uint* restrict statuses, const __global rp_page* restrict pages, uint slot_count, __global uint* restrict queue,
                      __global uint* restrict free_list, volatile __global uint* restrict counters, __global ulong* restrict sleep_groups,
                      uint bit_scale, ulong came, uint slots_together) {
    __local uint awake[RP_WAKE_GROUP * RP_WAKE_SLEEP_GROUPS], awake_count, count[RP_COUNTED_KINDS], base[RP_LISTS_FILLED];
    const uint item = get_local_id(0), sleep_group_count = (slot_count + RP_SLEEP_GROUP - 1u) / RP_SLEEP_GROUP;
    for (uint kind = item; kind < RP_COUNTED_KINDS; kind += RP_WAKE_GROUP) count[kind] = 0u;
    if (item == 0u) awake_count = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint waiting = rp_find_awake(sleep_groups, sleep_group_count, came, awake, &awake_count);
    // The words of sleeping groups, too: other work-items change them from here on.
    barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
    ulong kinds[RP_WAKE_SLEEP_GROUPS];
    uint mine[RP_LISTED_KINDS];
#pragma unroll
    for (uint kind = 0u; kind < RP_LISTED_KINDS; kind++) mine[kind] = 0u;
#pragma unroll 1
    for (uint k = 0u; k < RP_WAKE_SLEEP_GROUPS; k++) {
        const uint at = k * RP_WAKE_GROUP + item;
        kinds[k] = ~0ul;
        if (at >= awake_count) continue;
        ulong blocks = 0ul;
        kinds[k] = rp_keep_together(rp_sleep_group_kinds(statuses, pages, slot_count, awake[at], bit_scale, &blocks), slots_together);
        const uint wait = rp_count_kind(kinds[k], RP_KIND_WAITING), end = rp_count_kind(kinds[k], RP_KIND_IDLE);
        sleep_groups[awake[at]] = wait + end == RP_SLEEP_GROUP ? rp_asleep(wait, blocks) : 0ul;
        waiting += wait;
#pragma unroll
        for (uint kind = 0u; kind < RP_LISTED_KINDS; kind++) mine[kind] += rp_count_kind(kinds[k], kind);
    }
#pragma unroll
    for (uint kind = 0u; kind < RP_LISTED_KINDS; kind++)
        if (mine[kind] != 0u) mine[kind] = atomic_add(&count[kind], mine[kind]);  // from now on: where this work-item's share begins
    if (waiting != 0u) atomic_add(&count[RP_KIND_WAITING], waiting);
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint list = item; list < RP_LISTS_FILLED; list += RP_WAKE_GROUP) {
        const uint total = rp_list_total(count, list);
        base[list] = total != 0u ? atomic_add(counters + rp_list_counter(list), total) : 0u;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    uint first_extend = base[0] + mine[RP_KIND_FIRST_EXTEND], extend = base[0] + count[RP_KIND_FIRST_EXTEND] + mine[RP_KIND_EXTEND];
    uint first_shadow = base[1] + mine[RP_KIND_FIRST_SHADOW], shadow = base[1] + count[RP_KIND_FIRST_SHADOW] + mine[RP_KIND_SHADOW];
    uint free = base[2] + mine[RP_KIND_FREE];
#ifdef RP_TEXTURES
    uint textured = base[4] + mine[RP_KIND_TEXTURED];
#endif
#pragma unroll 1
    for (uint k = 0u; k < RP_WAKE_SLEEP_GROUPS; k++) {
        if (k * RP_WAKE_GROUP + item >= awake_count) continue;
        const uint first = RP_SLEEP_GROUP * awake[k * RP_WAKE_GROUP + item];
        // Kind by kind, as most slots that are looked at wait when little is resident.
#define RP_LIST(kind, place) \
    for (ulong left = rp_of_kind(kinds[k], kind); left != 0ul; left &= left - 1ul) place = first + rp_lowest(left) / 4u
        RP_LIST(RP_KIND_FIRST_EXTEND, queue[first_extend++]);
        RP_LIST(RP_KIND_EXTEND, queue[extend++]);
        RP_LIST(RP_KIND_FIRST_SHADOW, queue[slot_count - 1u - first_shadow++]);
        RP_LIST(RP_KIND_SHADOW, queue[slot_count - 1u - shadow++]);
        RP_LIST(RP_KIND_FREE, free_list[free++]);
#ifdef RP_TEXTURES
        RP_LIST(RP_KIND_TEXTURED, free_list[slot_count - 1u - textured++]);
#endif
#undef RP_LIST
    }
}
