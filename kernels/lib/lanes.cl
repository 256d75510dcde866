// Persistent threads: a fixed number of work-items that fetch a new ray when theirs has ended, all lanes of a hardware vector together.
// That needs votes among lanes, which OpenCL C 1.2 does not have; RP_PERSISTENT is defined where a device's own instructions are known: the
// number of lanes with walks left below which those without fetch new ones. RP_LEAST_INNER, if defined, is the number of lanes at inner
// nodes below which those that have come to leaves go first.
#ifndef RP_LANES_CL
#define RP_LANES_CL

#include "raypager/abi/block.h"

#if defined(RP_PERSISTENT) && defined(RP_RECORD)
#error "persistent threads do not record: a ray that finds no room in the log leaves its walk alone"
#endif
#if (defined(RP_LEAST_INNER) && !defined(RP_PERSISTENT)) || (defined(RP_SHARED_STACK) && !defined(RP_GROUP_SIZE))
#error "definitions that go together are not"
#endif

#if defined(RP_PERSISTENT) && defined(RP_NV_PTX)
// Bit i: condition of lane i. All 32 lanes come together here.
static inline uint rp_ballot(bool condition) {
    uint r;
    asm volatile("{.reg .pred p; setp.ne.u32 p, %1, 0; vote.sync.ballot.b32 %0, p, 0xffffffff;}" : "=r"(r) : "r"((uint)condition));
    return r;
}
// Bit i: lane i is at an inner node, or, as a number with a sign, not below 0.
static inline uint rp_ballot_inner(uint current) {
    uint r;
    asm volatile("{.reg .pred p; setp.ge.s32 p, %1, 0; vote.sync.ballot.b32 %0, p, 0xffffffff;}" : "=r"(r) : "r"(current));
    return r;
}
static inline uint rp_lane(void) {
    uint r;
    asm("mov.u32 %0, %%laneid;" : "=r"(r));
    return r;
}
static inline uint rp_from_lane(uint value, uint lane) {
    uint r;
    asm volatile("shfl.sync.idx.b32 %0, %1, %2, 31, 0xffffffff;" : "=r"(r) : "r"(value), "r"(lane));
    return r;
}
// One number each, counted up from *counter, for the lanes that want one.
static inline uint rp_take_numbers(bool wanted, volatile __global uint* counter) {
    const uint takers = rp_ballot(wanted), lane = rp_lane();
    if (takers == 0u) return 0u;
    const uint leader = 31u - clz(takers);
    uint first = 0u;
    if (lane == leader) first = atomic_add(counter, popcount(takers));
    return rp_from_lane(first, leader) + popcount(takers & ((1u << lane) - 1u));
}
// Lanes that have run ahead wait for the others.
#define RP_CONVERGE() asm volatile("bar.warp.sync 0xffffffff;")
#elif defined(RP_PERSISTENT)
// Vectors of one lane, with which tests come by the same loops on any device.
static inline uint rp_ballot(bool condition) { return condition ? 1u : 0u; }
static inline uint rp_ballot_inner(uint current) { return rp_ballot(!(current & RP_REF_LEAF)); }
static inline uint rp_take_numbers(bool wanted, volatile __global uint* counter) { return wanted ? atomic_inc(counter) : 0u; }
#define RP_CONVERGE()
#endif

#ifdef RP_PERSISTENT
// Whether enough walks are left to go on before new rays are fetched. current: a reference as in abi/block.h.
#define RP_GOES_ON(current) (popcount(rp_ballot((current) < RP_REF_STOPPED)) >= RP_PERSISTENT)
#else
#define RP_CONVERGE()
#define RP_GOES_ON(current) ((current) < RP_REF_STOPPED)
#endif

// The loop over inner nodes: all lanes come to it together and leave it together, with RP_LEAST_INNER some of them still at inner nodes.
#ifdef RP_LEAST_INNER
static inline bool rp_stays_inner(uint current) {
    const uint inner = rp_ballot_inner(current);
    if (popcount(inner) >= RP_LEAST_INNER) return true;
    return inner != 0u && rp_ballot((current & RP_REF_LEAF) && current < RP_REF_STOPPED) == 0u;
}
#define RP_WHILE_INNER(current)              \
    while (rp_stays_inner(current))          \
        if (!((current) & RP_REF_LEAF))
#define RP_AT_LEAF(current) (((current) & RP_REF_LEAF) && (current) < RP_REF_PORTAL)
#else
#define RP_WHILE_INNER(current) while (!((current) & RP_REF_LEAF))
#define RP_AT_LEAF(current) ((current) < RP_REF_PORTAL)
#endif

#endif
