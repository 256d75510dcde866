// Streams are filled from path slots, eight rays at a time.
#ifndef RP_STREAM_SLOTS_CL
#define RP_STREAM_SLOTS_CL

#include "stream/path_state8.cl"
#include "stream/stream.cl"

// Of a stream's rays, by the status words of their slots, those that had waited.
static inline ulong rp_resumed_rays(const uint* status) {
    ulong resumed = 0ul;
    for (uint i = 0u; i < RP_STREAM_RAYS / 8u; i++) resumed |= (ulong)rp_mask8(rp_have_waited8(vload8(i, status))) << (8u * i);
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
