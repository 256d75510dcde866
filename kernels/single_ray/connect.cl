// Fifth stage: traces the shadow rays of the queue, and lets their paths go on or end. Shading adds the light of those that arrive and go on.
#include "common/end_path.cl"
#include "common/leaf.cl"
#include "common/path_state.cl"
#include "common/queue.cl"

#define RP_ANY_HIT 1
#include "single_ray/traverse.cl"
#undef RP_ANY_HIT

static inline void rp_connect_ray(const rp_geometry* geometry, volatile __global uint* demand, uint block_count, uint round, const rp_paths* paths,
                                  uint slot, __constant rp_render_params* params, const __global rp_primitive_range* ranges,
                                  __global uint* film RP_VISIT_PARAMETER) {
    const uint status = rp_status_of(paths, slot);
    const rp_shadow_ray ray = rp_shadow_of(paths, slot, status);
    rp_any_walk walk;
    uint stack[RP_STACK_SIZE];
    walk.ray = rp_make_ray(ray.origin, ray.direction);
    walk.search.t_limit = ray.t_max;
#ifdef RP_CUTOUTS
    walk.search.ranges = ranges;
    walk.search.range_count = params->range_count;
    walk.search.met_cutout = rp_has_met_cutout(status);
#endif
#ifdef RP_RECORD
    if (!rp_visit_begin(&walk.visits, geometry, visit_words, demand, block_count, paths, slot, RP_VISIT_BEGIN_SHADOW, RP_VISIT_RESUME_SHADOW)) return;
    if (walk.visits.on && ray.block_entry == RP_NONE && !rp_visit_candidates(&walk.visits, geometry, &walk.ray, ray.t_max)) {
        rp_visit_end(&walk.visits, RP_VISIT_NO_BLOCK);
        return;  // begins anew in the next round
    }
#endif
#ifdef RP_INSTANCES
    const rp_standing standing = rp_standing_of(paths, slot, ray.block_entry != RP_NONE);
    rp_begin_any(geometry, &walk, stack, ray.block_entry, &standing);
#else
    rp_begin_any(geometry, &walk, stack, ray.block_entry);
#endif
    rp_traverse_any(geometry, &walk, stack, round);
#ifdef RP_RECORD
    rp_visit_end(&walk.visits, walk.visits.stopped_by);
#endif
    const uint block_entry = rp_any_block_entry(&walk);
    if (block_entry != RP_NONE) {
#ifdef RP_INSTANCES
        const uint stands_at = rp_any_stands_at(&walk, block_entry);
        rp_set_block_entry(paths, slot, stands_at == RP_NONE ? block_entry : rp_any_entry_in_world(&walk));
#if RP_INSTANCE_LEVELS > 1
        rp_set_standing(paths, slot, &walk.ray, walk.entry_around, stands_at, 0);
#else
        rp_set_standing(paths, slot, &walk.ray, stands_at, 0u);
#endif
#else
        rp_set_block_entry(paths, slot, block_entry);
#endif
        uint seen = status;
#ifdef RP_CUTOUTS
        seen = rp_with_cutout_met(seen, walk.search.met_cutout);
#endif
        rp_wait_for_block(paths, slot, rp_block_entry_block(geometry, block_entry), rp_shadow_waits(seen), demand, block_count);
        return;
    }
#ifdef RP_CUTOUTS
    if (!walk.hit && walk.search.met_cutout) {
        rp_trace_shadow_as_extension(paths, slot, status);
        return;
    }
#endif
    const rp_path_end end = rp_finish_shadow(paths, slot, status, walk.hit);
    if (end.ended) rp_add_sample(params, paths, slot, film, end.pixel, end.radiance);
}

__kernel void rp_connect(RP_GEOMETRY_PARAMETERS, uint block_count, uint round, uint slot_count, const __global uint* restrict queue,
                         __global uint* restrict status, __global uint4* restrict planes, const __global uint* restrict counters,
                         __constant rp_render_params* restrict params, const __global rp_primitive_range* restrict ranges,
                         __global uint* restrict film RP_VISIT_PARAMETER) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    const rp_paths paths = {slot_count, status, planes};
    const uint count = counters[RP_COUNT_SHADOW];
    for (uint i = get_global_id(0); i < count; i += get_global_size(0))
        rp_connect_ray(&geometry, demand, block_count, round, &paths, rp_shadow_entry(queue, slot_count, i), params, ranges, film RP_VISIT_ARGUMENT);
}
