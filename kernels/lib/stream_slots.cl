// Path slots (abi/path.h) to streams and back. In a slot all words of a ray lie together, in a stream one word of all rays.
#ifndef RP_STREAM_SLOTS_CL
#define RP_STREAM_SLOTS_CL

#include "lib/path.cl"
#include "lib/stream.cl"

// Rows to columns: word k of m[i] becomes word i of m[k]. In three steps of eight shuffles each, which is what processors have.
static inline void rp_transpose8(uint8* m) {
    uint8 a[8], b[8];
#pragma unroll
    for (uint i = 0u; i < 8u; i += 2u) {
        const uint8 p = m[i], q = m[i + 1u];
        a[i] = (uint8)(p.s0, q.s0, p.s1, q.s1, p.s4, q.s4, p.s5, q.s5);
        a[i + 1u] = (uint8)(p.s2, q.s2, p.s3, q.s3, p.s6, q.s6, p.s7, q.s7);
    }
#pragma unroll
    for (uint i = 0u; i < 8u; i += 4u) {
#pragma unroll
        for (uint odd = 0u; odd < 2u; odd++) {
            const uint8 p = a[i + odd], q = a[i + 2u + odd];
            b[i + 2u * odd] = (uint8)(p.s01, q.s01, p.s45, q.s45);
            b[i + 2u * odd + 1u] = (uint8)(p.s23, q.s23, p.s67, q.s67);
        }
    }
#pragma unroll
    for (uint i = 0u; i < 4u; i++) {
        m[i] = (uint8)(b[i].lo, b[i + 4u].lo);
        m[i + 4u] = (uint8)(b[i].hi, b[i + 4u].hi);
    }
}

// A plane and the one beside it (RP_PLANE_PAIR) of eight slots: words[k] is word k of all of them; the second plane's begin with 4.
static inline void rp_read_slots(const __global uint4* paths, uint plane, uint slot_count, const uint* slot, uint8* words) {
#pragma unroll
    for (uint i = 0u; i < 8u; i++) words[i] = vload8(0, (const __global uint*)&RP_PLANE(paths, plane, slot_count, slot[i]));
    rp_transpose8(words);
}

// Of a stream's rays, by the status words of their slots, those that had waited.
static inline ulong rp_resumed_rays(const uint* state) {
    ulong resumed = 0ul;
    for (uint i = 0u; i < RP_STREAM_RAYS / 8u; i++) resumed |= (ulong)rp_mask8((vload8(i, state) & RP_STATUS_RESUMED) != 0u) << (8u * i);
    return resumed;
}

// Rays 8 i to 8 i + 7 of a stream, by coordinate.
static inline void rp_set_stream_rays(rp_stream* s, uint i, const uint8* origin, const uint8* direction, uint8 t, uint8 primitive) {
#pragma unroll
    for (uint a = 0u; a < 3u; a++) {
        vstore8(as_float8(origin[a]), i, (float*)s->origin[a]);
        vstore8(as_float8(direction[a]), i, (float*)s->direction[a]);
    }
    vstore8(as_float8(t), i, (float*)s->t);
    vstore8(primitive, i, (uint*)s->primitive);
}

#endif
