// Fifth stage: traces the shadow rays of the queue, and lets their paths go on or end. Shading adds the light of those that arrive and go on.
#include "lib/connection.cl"
#include "lib/leaf.cl"

#define RP_ANY_HIT 1
#include "lib/traverse.cl"
#undef RP_ANY_HIT

static inline void rp_connect_ray(const rp_geometry* geometry, volatile __global uint* wants, uint round, uint slot_count, uint slot,
                                  __global uint* status, __global uint4* paths, __global uint* film RP_VISIT_PARAMETER) {
    const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot), direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot);
    const uint state = status[slot];
    const uint start = (state & RP_STATUS_MASK) == RP_STATUS_SHADOW_WAITS ? RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot).w : RP_NONE;
    rp_any_walk walk;
    uint stack[RP_STACK_SIZE];
    walk.ray = rp_make_ray(as_float3(origin.xyz), as_float3(direction.xyz));
    walk.t_max = as_float(origin.w);
#ifdef RP_RECORD
    if (!rp_visit_begin(&walk.visits, geometry, visit_words, wants, slot_count, slot, state, paths, RP_VISIT_BEGIN_SHADOW,
                        RP_VISIT_RESUME_SHADOW))
        return;
    if (walk.visits.on && start == RP_NONE && !rp_visit_candidates(&walk.visits, geometry, &walk.ray, walk.t_max)) {
        rp_visit_end(&walk.visits, RP_VISIT_NO_BLOCK);
        return;  // begins anew in the next round
    }
#endif
    rp_begin_any(geometry, &walk, stack, start);
    rp_run_any(geometry, &walk, stack, round);
#ifdef RP_RECORD
    rp_visit_end(&walk.visits, walk.visits.stopped_by);
#endif
    const uint portal = rp_any_portal(&walk);
    if (portal != RP_NONE) {
        rp_set_portal(slot, portal, slot_count, paths);
        rp_wait_for(slot, rp_portal_block(geometry, portal), RP_STATUS_SHADOW_WAITS | (state & RP_STATUS_ENDS), slot_count, status, wants);
    } else {
        rp_end_shadow_ray(slot, state, RP_STATUS_FIRST, walk.hit, slot_count, status, paths, film);
    }
}

__kernel void rp_connect(RP_GEOMETRY_PARAMETERS, uint block_count, uint round, uint slot_count, const __global uint* restrict queue,
                         __global uint* restrict status, __global uint4* restrict paths, const __global uint* restrict counters,
                         __global uint* restrict film RP_VISIT_PARAMETER) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(demand + RP_DEMAND_USED * block_count);
    const uint count = counters[RP_COUNT_SHADOW];
    for (uint i = get_global_id(0); i < count; i += get_global_size(0))
        rp_connect_ray(&geometry, demand + RP_DEMAND_WANTS * block_count, round, slot_count, rp_shadow_entry(queue, slot_count, i), status, paths, film
                       RP_VISIT_ARGUMENT);
}
