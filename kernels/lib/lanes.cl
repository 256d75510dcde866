// Persistent threads: a fixed number of work-items that fetch a new ray when theirs has ended, all lanes of a hardware vector together.
// That needs votes among lanes, which OpenCL C 1.2 does not have; RP_PERSISTENT is defined where a device's own instructions are known.
#ifndef RP_LANES_CL
#define RP_LANES_CL

#if defined(RP_PERSISTENT) && defined(RP_NV_PTX)
// Bit i: condition of lane i. All 32 lanes come together here.
static inline uint rp_ballot(bool condition) {
    uint r;
    asm volatile("{.reg .pred p; setp.ne.u32 p, %1, 0; vote.sync.ballot.b32 %0, p, 0xffffffff;}" : "=r"(r) : "r"((uint)condition));
    return r;
}
static inline uint rp_active_lanes(void) {
    uint r;
    asm volatile("activemask.b32 %0;" : "=r"(r));
    return popcount(r);
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
#endif

#endif
