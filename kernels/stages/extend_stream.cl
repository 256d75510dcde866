// Third stage on CPUs: does what extend.cl does, with streams of rays over the wide form of the blocks, surfaces included.
#include "lib/path.cl"
#include "lib/stream_traverse.cl"
#include "lib/waiting_lists.cl"
#include "lib/wide_surface.cl"

// What is known of the rays of a stream beside their paths through space.
typedef struct rp_extend_rays {
    uint first, count;  // in the queue
    uint slot[RP_STREAM_RAYS], sample[RP_STREAM_RAYS], portal[RP_STREAM_RAYS], state[RP_STREAM_RAYS];
} rp_extend_rays;

static inline void rp_load_extend_stream(const rp_geometry* g, const __global uint4* paths, const __global uint* status, uint slot_count,
                                         const __global uint* queue, rp_stream* s, rp_extend_rays* e, const rp_share* share) {
    const uint count = e->count;
    uint next;
    const uint next_count = rp_expected_stream(share, &next);
    for (uint r = 0u; r < RP_STREAM_RAYS; r++) {
        if (r < next_count) rp_fetch_extension(paths, slot_count, rp_extend_entry(queue, next + r));
        const uint slot = rp_extend_entry(queue, e->first + min(r, count - 1u));
        const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot), direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot);
        rp_set_stream_ray(s, r, as_float3(origin.xyz), as_float3(direction.xyz), as_float(origin.w),
                          RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot).w);
        e->slot[r] = slot;
        const uint4 surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot);
        e->sample[r] = surface.z;
        e->portal[r] = surface.w;
        e->state[r] = status[slot];
    }
    s->active = count < RP_STREAM_RAYS ? (1ul << count) - 1ul : ~0ul;
    rp_prepare_stream(s);
    for (uint r = 0u; r < count; r++)
        if (e->portal[r] != RP_NONE) rp_resume_ray(s, r, g->portals, e->portal[r]);
}

// Counts of one work-item: extension rays that had waited, those of them that hit nothing in the block they had waited for, and rays that wait
// from now on.
typedef struct rp_extend_counts {
    uint served, no_hit, waiting;
} rp_extend_counts;

static inline void rp_store_extend_ray(const rp_geometry* g, const rp_stream* s, const rp_extend_rays* e, const rp_wide_surfaces* surfaces, uint r,
                                       uint slot_count, uint block_count, volatile __global uint* demand, __global uint* status,
                                       __global uint4* paths, rp_extend_counts* counts) {
    const uint slot = e->slot[r], waited_at = e->portal[r];
    const float t = RP_OF_RAY(s->t, r);
    const uint portal = rp_waits_at(s, r);
    uint offset_exponent = rp_state_offset(e->state[r]);
    const bool hit = rp_hit_in_launch(s, r);
    if (hit) {
        offset_exponent = surfaces->offset_exponent[r];
        const float3 position = (float3)(surfaces->position[0][r], surfaces->position[1][r], surfaces->position[2][r]);
        ((__global float*)&RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot))[3] = t;
        RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)(as_uint3(position), ((const uint*)s->primitive)[r]);
        RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) =
            (uint4)(surfaces->geometric_normal[r], surfaces->shading_normal[r], e->sample[r], portal);
    } else if (portal != waited_at) {
        rp_set_portal(slot, portal, slot_count, paths);
    }
    if (waited_at != RP_NONE) {
        counts->served++;
        if (!hit || rp_hit_leaf(s, r)->block != rp_portal_block(g, waited_at)) counts->no_hit++;
    }
    if (portal == RP_NONE) {
        const uint block = hit ? rp_block_state(rp_hit_leaf(s, r)->block) : e->state[r] & RP_STATUS_BLOCK_MASK;
        status[slot] = RP_STATUS_SHADE | offset_exponent << RP_STATUS_OFFSET_SHIFT | block;
#ifdef RP_COUNT_BOUNCES
        if (hit) atomic_inc(demand + RP_DEMAND_BOUNCES * block_count + rp_hit_leaf(s, r)->block);
#endif
    } else {
        counts->waiting++;
        rp_wait_in_list(slot, e->first / RP_STREAM_RAYS, rp_portal_block(g, portal), RP_STATUS_EXTEND_WAITS, offset_exponent, slot_count, status, demand, block_count);
    }
}

// A work-item traces RP_WALKS streams of 64 rays in turn: while one computes, the next record of another is on its way from memory.
__kernel void rp_extend_stream(RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top, uint block_count, uint round, uint slot_count,
                               const __global uint* restrict queue, __global uint* restrict status, __global uint4* restrict paths,
                               volatile __global uint* restrict counters) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(demand + RP_DEMAND_USED * block_count);
    rp_share share = rp_share_of(counters[RP_COUNT_EXTEND]);
    rp_extend_counts counts = {0u, 0u, 0u};
    rp_walk walks[RP_WALKS];
    rp_extend_rays rays[RP_WALKS];
    uint running = 0u;
    for (uint w = 0u; w < RP_WALKS; w++) {
        rays[w].count = rp_next_stream(&share, counters + RP_COUNT_EXTEND_TAKEN, &rays[w].first);
        if (rays[w].count == 0u) continue;
        rp_load_extend_stream(&geometry, paths, status, slot_count, queue, &walks[w].stream, &rays[w], &share);
        rp_begin_walk(&walks[w], wide_top);
        running |= 1u << w;
    }
    for (uint w = 0u; running != 0u; w = w + 1u < RP_WALKS ? w + 1u : 0u) {
        if (!(running >> w & 1u)) continue;
        if (walks[w].rays != 0ul) {
            rp_step(&geometry, &walks[w], round, false);
            continue;
        }
        rp_wide_surfaces surfaces;
        rp_find_surfaces(&walks[w].stream, &surfaces);
        for (uint r = 0u; r < rays[w].count; r++)
            rp_store_extend_ray(&geometry, &walks[w].stream, &rays[w], &surfaces, r, slot_count, block_count, demand, status, paths,
                                &counts);
        rays[w].count = rp_next_stream(&share, counters + RP_COUNT_EXTEND_TAKEN, &rays[w].first);
        if (rays[w].count == 0u) {
            running &= ~(1u << w);
        } else {
            rp_load_extend_stream(&geometry, paths, status, slot_count, queue, &walks[w].stream, &rays[w], &share);
            rp_begin_walk(&walks[w], wide_top);
        }
    }
    rp_count_add(counters + RP_COUNT_WANTS_SERVED, counts.served);
    rp_count_add(counters + RP_COUNT_WANTS_NO_HIT, counts.no_hit);
    if (counts.waiting != 0u) atomic_add(counters + RP_COUNT_IN_LISTS, counts.waiting);
}
