// Persistent threads: a fixed number of work-items that fetch a new ray when theirs has ended, all work-items of a sub-group (a warp) together.
// That needs votes in a sub-group, which OpenCL C 1.2 does not have; RP_PERSISTENT is defined where a device's own instructions are known: the
// number of work-items with walks left below which those without fetch new ones. RP_MIN_INNER, if defined, is the number of work-items at inner
// nodes below which those that have come to leaves go first.
#ifndef RP_PERSISTENT_CL
#define RP_PERSISTENT_CL

#include "common/bits.cl"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"

#if defined(RP_PERSISTENT) && defined(RP_RECORD)
#error "persistent threads do not record: a ray that finds no room in the log leaves its walk alone"
#endif
#if defined(RP_PART_RUN) != defined(RP_PERSISTENT) || (defined(RP_MIN_INNER) && !defined(RP_PERSISTENT)) || \
    defined(RP_SHARED_STACK) != defined(RP_MIN_INNER) || (defined(RP_SHARED_STACK) && !defined(RP_GROUP_SIZE))
#error "definitions that go together are not"
#endif

// Rays that follow each other in the queue share what they read, so those that a processor traces at a time should lie together: it has a part of the
// queue, of which its sub-groups take the next rays, and then goes on with the parts of others. RP_PART_RUN: so many rays in a row are of one part.
// Where no processor has a number, there are three parts, so that tests come by them.
#if defined(RP_PART_RUN) && defined(RP_NV_PTX)
static inline uint rp_part_count(void) {
    uint r;
    asm("mov.u32 %0, %%nsmid;" : "=r"(r));
    return min(r, RP_MAX_PARTS);
}
static inline uint rp_own_part(uint parts) {
    uint r;
    asm volatile("mov.u32 %0, %%smid;" : "=r"(r));
    return r % parts;
}
#elif defined(RP_PART_RUN)
static inline uint rp_part_count(void) { return 3u; }
static inline uint rp_own_part(uint parts) { return get_group_id(0) % parts; }
#endif
#ifdef RP_PART_RUN
// Where in the queue the ray with this number of a part stands.
static inline uint rp_part_position(uint number, uint part, uint parts) {
    return (number / RP_PART_RUN * parts + part) * RP_PART_RUN + number % RP_PART_RUN;
}
#endif

#if defined(RP_PERSISTENT) && defined(RP_NV_PTX)
// Bit i: condition of work-item i of the sub-group. All 32 come together here.
static inline uint rp_ballot(bool condition) {
    uint r;
    asm volatile("{.reg .pred p; setp.ne.u32 p, %1, 0; vote.sync.ballot.b32 %0, p, 0xffffffff;}" : "=r"(r) : "r"((uint)condition));
    return r;
}
// Bit i: work-item i is at an inner node, or, as a number with a sign, not below 0.
static inline uint rp_ballot_inner(uint current) {
    uint r;
    asm volatile("{.reg .pred p; setp.ge.s32 p, %1, 0; vote.sync.ballot.b32 %0, p, 0xffffffff;}" : "=r"(r) : "r"(current));
    return r;
}
// The number of this work-item in its sub-group.
static inline uint rp_subgroup_index(void) {
    uint r;
    asm("mov.u32 %0, %%laneid;" : "=r"(r));
    return r;
}
// What work-item `index` of the sub-group has for value.
static inline uint rp_from_subgroup_index(uint value, uint index) {
    uint r;
    asm volatile("shfl.sync.idx.b32 %0, %1, %2, 31, 0xffffffff;" : "=r"(r) : "r"(value), "r"(index));
    return r;
}
// A value of which the compiler knows nothing. Where it knows what some work-items will vote it may give them a copy of the vote, at which they wait
// for ever.
static inline uint rp_opaque(uint value) {
    asm volatile("mov.b32 %0, %0;" : "+r"(value));
    return value;
}
// One number each, counted up from *counter, for the work-items that want one.
static inline uint rp_take_numbers(bool wanted, volatile __global uint* counter) {
    const uint takers = rp_ballot(wanted), index = rp_subgroup_index();
    if (takers == 0u) return 0u;
    const uint leader = 31u - clz(takers);
    uint first = 0u;
    if (index == leader) first = atomic_add(counter, popcount(takers));
    return rp_from_subgroup_index(first, leader) + popcount(takers & ((1u << index) - 1u));
}
// The next part behind this one of which not all are taken, or RP_NONE. taken: numbers taken, of each part; count: rays in the queue.
static inline uint rp_next_part(volatile __global uint* taken, uint part, uint parts, uint count) {
    uint next = RP_NONE;
    for (uint base = 1u; base < parts && next == RP_NONE; base += 32u) {
        const uint ahead = base + rp_subgroup_index(), other = (part + ahead) % parts;
        const uint left = rp_ballot(rp_opaque((ahead < parts) & (rp_part_position(taken[other], other, parts) < count)) != 0u);
        const uint found = rp_from_subgroup_index(other, rp_lowest_bit(left));
        next = left != 0u ? found : next;
    }
    return next;
}
// Work-items of a sub-group that have run ahead wait for the others.
#define RP_CONVERGE() asm volatile("bar.warp.sync 0xffffffff;")
#elif defined(RP_PERSISTENT)
// Sub-groups of one work-item, with which tests come by the same loops on any device.
static inline uint rp_ballot(bool condition) { return condition ? 1u : 0u; }
static inline uint rp_ballot_inner(uint current) { return rp_ballot(!(current & RP_REF_LEAF)); }
static inline uint rp_take_numbers(bool wanted, volatile __global uint* counter) { return wanted ? atomic_inc(counter) : 0u; }
static inline uint rp_next_part(volatile __global uint* taken, uint part, uint parts, uint count) {
    for (uint ahead = 1u; ahead < parts; ahead++) {
        const uint other = (part + ahead) % parts;
        // Others count there.
        if (rp_part_position(atomic_add(taken + other, 0u), other, parts) < count) return other;
    }
    return RP_NONE;
}
#define RP_CONVERGE()
#endif

#ifdef RP_PERSISTENT
// Whether enough walks are left to go on before new rays are fetched. current: a reference as in abi/block.h.
#define RP_GOES_ON(current) (popcount(rp_ballot((current) < RP_REF_STOPPED)) >= RP_PERSISTENT)
#else
#define RP_CONVERGE()
#define RP_GOES_ON(current) ((current) < RP_REF_STOPPED)
#endif

// The loop over inner nodes: all of a sub-group come to it together and leave it together, with RP_MIN_INNER some of them still at inner nodes.
#ifdef RP_MIN_INNER
static inline bool rp_stays_inner(uint current) {
    const uint inner = rp_ballot_inner(current);
    if (popcount(inner) >= RP_MIN_INNER) return true;
    return inner != 0u && rp_ballot((current & RP_REF_LEAF) && current < RP_REF_STOPPED) == 0u;
}
#define RP_WHILE_INNER(current)     \
    while (rp_stays_inner(current)) \
        if (!((current)&RP_REF_LEAF))
#define RP_AT_LEAF(current) (((current)&RP_REF_LEAF) && (current) < RP_REF_BLOCK_ENTRY)
#else
#define RP_WHILE_INNER(current) while (!((current)&RP_REF_LEAF))
#define RP_AT_LEAF(current) ((current) < RP_REF_BLOCK_ENTRY)
#endif

#endif
