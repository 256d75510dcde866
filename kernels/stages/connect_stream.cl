// On CPUs, what connect.cl does, with streams of rays over the wide form of the blocks. In a render this is a part of trace_stream.cl.
#include "lib/apart.cl"
#include "lib/connection.cl"
#include "lib/stream_slots.cl"
#include "lib/stream_traverse.cl"
#include "lib/waiting_lists.cl"

typedef struct rp_connect_rays {
    uint first, count;  // in the queue
    uint slot[RP_STREAM_RAYS], state[RP_STREAM_RAYS];
} rp_connect_rays;

static inline void rp_load_connect_stream(const rp_geometry* g, const __global uint4* paths, const __global uint* status, uint slot_count,
                                          const __global uint* queue, rp_stream* s, rp_connect_rays* c, const rp_share* share) {
    const uint count = c->count;
    uint next;
    const uint next_count = rp_expected_stream(share, &next);
    for (uint r = 0u; r < next_count; r++) rp_fetch_early(&RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, rp_shadow_entry(queue, slot_count, next + r)));
    for (uint r = 0u; r < RP_STREAM_RAYS; r++) {
        c->slot[r] = rp_shadow_entry(queue, slot_count, c->first + min(r, count - 1u));
        c->state[r] = status[c->slot[r]];
    }
    for (uint i = 0u; i < RP_STREAM_RAYS / 8u; i++) {
        uint8 ray[8];
        rp_read_slots(paths, RP_PLANE_ORIGIN, slot_count, c->slot + 8u * i, ray);
        rp_set_stream_rays(s, i, ray, ray + 4, ray[3], (uint8)(RP_NONE));
    }
    s->active = count < RP_STREAM_RAYS ? (1ul << count) - 1ul : ~0ul;
    rp_prepare_stream(s);
    for (ulong resumed = rp_resumed_rays(c->state) & s->active; resumed != 0ul; resumed &= resumed - 1ul) {
        const uint r = rp_lowest(resumed);
        rp_resume_ray(s, r, g->portals, RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, c->slot[r]).w);
    }
}

// Returns whether the ray waits from now on.
static inline bool rp_store_connect_ray(const rp_geometry* g, const rp_stream* s, const rp_connect_rays* c, uint r, uint slot_count,
                                        uint block_count, volatile __global uint* demand, __global uint* status,
                                        __global uint4* paths, __global uint* film, rp_chains* chains) {
    const bool occluded = !(s->active >> r & 1ul);
    const uint portal = occluded ? RP_NONE : rp_waits_at(s, r);
    if (portal == RP_NONE) {
        rp_end_shadow_ray(c->slot[r], c->state[r], RP_STATUS_BLOCK_MASK, occluded, slot_count, status, paths, film);
        return false;
    }
    rp_set_portal(c->slot[r], portal, slot_count, paths);
    rp_wait_in_chain(chains, c->slot[r], rp_portal_block(g, portal), RP_STATUS_SHADOW_WAITS | (c->state[r] & RP_STATUS_ENDS), slot_count, status, demand,
                     block_count);
    return true;
}

// Returns how many of them wait from now on.
static inline uint rp_store_connect_stream(const rp_geometry* g, const rp_stream* s, const rp_connect_rays* c, uint slot_count, uint block_count,
                                           volatile __global uint* demand, __global uint* status, __global uint4* paths, __global uint* film) {
    rp_chains chains;
    rp_begin_chains(&chains, c->first / RP_STREAM_RAYS, true);
    uint waiting = 0u;
    for (uint r = 0u; r < c->count; r++)
        waiting += rp_store_connect_ray(g, s, c, r, slot_count, block_count, demand, status, paths, film, &chains) ? 1u : 0u;
    rp_end_chains(&chains, slot_count, status, demand, block_count);
    return waiting;
}

// As rp_extend_streams.
static RP_APART void rp_connect_streams(const rp_geometry* g, rp_share share, const __global uchar* restrict wide_top, uint block_count, uint round,
                                        uint slot_count, const __global uint* restrict queue, volatile __global uint* demand,
                                        __global uint* restrict status, __global uint4* restrict paths, volatile __global uint* restrict counters,
                                        __global uint* restrict film) {
    rp_walk walks[RP_WALKS];
    rp_connect_rays rays[RP_WALKS];
    for (uint w = 0u; w < RP_WALKS; w++) walks[w].rays = 0ul, rays[w].count = 0u;
    uint running = (1u << RP_WALKS) - 1u, waiting = 0u;
    for (uint w = 0u; running != 0u; w = w + 1u < RP_WALKS ? w + 1u : 0u) {
        if (!(running >> w & 1u)) continue;
        if (walks[w].rays != 0ul) {
            rp_step(g, &walks[w], round, true);
            continue;
        }
        if (rays[w].count != 0u)
            waiting += rp_store_connect_stream(g, &walks[w].stream, &rays[w], slot_count, block_count, demand, status, paths, film);
        rays[w].count = rp_next_stream(&share, counters + RP_COUNT_SHADOW_TAKEN, &rays[w].first);
        if (rays[w].count == 0u) {
            running &= ~(1u << w);
        } else {
            rp_load_connect_stream(g, paths, status, slot_count, queue, &walks[w].stream, &rays[w], &share);
            rp_begin_walk(&walks[w], wide_top);
        }
    }
    if (waiting != 0u) atomic_add(counters + RP_COUNT_IN_LISTS, waiting);
}

#ifndef RP_WITHOUT_KERNELS
__kernel void rp_connect_stream(RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top, uint block_count, uint round, uint slot_count,
                                const __global uint* restrict queue, __global uint* restrict status, __global uint4* restrict paths,
                                volatile __global uint* restrict counters, __global uint* restrict film) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(demand + RP_DEMAND_USED * block_count);
    rp_connect_streams(&geometry, rp_share_of(counters[RP_COUNT_SHADOW]), wide_top, block_count, round, slot_count, queue, demand, status, paths, counters,
                       film);
}
#endif
