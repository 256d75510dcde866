// Third stage: traces the extension rays of the queue until they have found their closest hit or come to an absent block.
#include "single_ray/persistent.cl"
#include "common/path_state.cl"
#include "common/queue.cl"
#include "shading/surface.cl"

#define RP_ANY_HIT 0
#include "single_ray/traverse.cl"
#undef RP_ANY_HIT

// Takes up the ray of a slot where it stands.
static inline void rp_take_up(const rp_geometry* geometry, rp_closest_walk* walk, uint2* stack, const rp_paths* paths, uint slot) {
    const rp_extension_ray ray = rp_extension_of(paths, slot);
    walk->best.t = ray.t;
    walk->best.what = ray.primitive;
    walk->best.found_in = RP_NONE;
    walk->ray = rp_make_ray(ray.origin, ray.direction);
#ifdef RP_INSTANCES
#if RP_INSTANCE_LEVELS > 1
    walk->best.chain = ray.in;
#else
    walk->best.number = ray.number;
#endif
    walk->best.instance = 0;
    const rp_standing standing = rp_standing_of(paths, slot, ray.block_entry != RP_NONE);
    rp_begin_closest(geometry, walk, stack, ray.block_entry, &standing);
#else
    rp_begin_closest(geometry, walk, stack, ray.block_entry);
#endif
}

// Puts down what became of it. mine: counts of requests served, and of those without a hit.
static inline void rp_put_down(const rp_geometry* geometry, const rp_closest_walk* walk, uint block_count, volatile __global uint* demand,
                               const rp_paths* paths, uint slot, uint* mine) {
    const rp_hit* hit = &walk->best;
    const uint status = rp_status_of(paths, slot), block_entry = rp_closest_block_entry(walk);
#ifdef RP_INSTANCES
    const uint stands_at = rp_closest_stands_at(walk, block_entry);
    const uint world_entry = block_entry == RP_NONE || stands_at == RP_NONE ? block_entry : rp_closest_entry_in_world(walk);
#else
    const uint world_entry = block_entry;
#endif
    mine[0] += (walk->shear.axis & (RP_WALK_SERVED | RP_WALK_IN_VAIN)) != 0u;
    mine[1] += (walk->shear.axis & RP_WALK_IN_VAIN) != 0u;
#ifdef RP_TRAITS
    if (hit->found_in != RP_NONE) rp_set_traits(paths, slot, rp_instance_traits_number(hit->instance));
#endif
#if defined(RP_HIT_IDS) && defined(RP_INSTANCES)
#if RP_INSTANCE_LEVELS > 1
    if (hit->found_in != RP_NONE) rp_set_ids(paths, slot, hit->instance ? hit->chain.instance[0] : 0, hit->chain.number[0]);
#else
    if (hit->found_in != RP_NONE) rp_set_ids(paths, slot, hit->instance, hit->number);
#endif
#endif
#ifdef RP_SHORT_STATES
#ifdef RP_INSTANCES
    // Of an instance's surface what is there is found here: its block may be one of many.
    if (block_entry == RP_NONE && !hit->instance) {
#else
    if (block_entry == RP_NONE) {
#endif
        // Shading, which comes next, finds the surface: there all work-items of a sub-group do so at once.
        rp_finish_extension_deferred(paths, slot, status, hit->what, hit->found_in, hit->t);
    } else
#endif
    {
        uint offset_exponent = rp_offset_exponent_of(status);
        rp_unfold_extension(paths, slot, status);
        if (hit->found_in != RP_NONE) {
#ifdef RP_INSTANCES
            const rp_surface s = rp_surface_in_world(geometry, walk->origin, walk->direction, hit);
#else
            // Read again, so that no register keeps it along the walk.
            rp_ray ray = walk->ray;
            ray.direction = rp_direction_of(paths, slot);
            const rp_surface s = rp_hit_surface(geometry, &ray, hit);
#endif
            offset_exponent = s.offset_exponent;
#ifdef RP_VERTEX_COLORS
            rp_set_color(paths, slot, s.color);
#endif
#ifdef RP_UVS
            rp_set_uv(paths, slot, s.uv, s.density);
#endif
#ifdef RP_TANGENTS
            rp_set_tangent(paths, slot, s.tangent);
#endif
            rp_store_hit(paths, slot, hit->t, s.position, rp_hit_primitive(geometry, hit), s.geometric_normal, s.shading_normal, world_entry);
        } else {
            rp_set_block_entry(paths, slot, world_entry);
        }
#ifdef RP_INSTANCES
#if RP_INSTANCE_LEVELS > 1
        if (block_entry != RP_NONE) rp_set_standing(paths, slot, &walk->ray, walk->entry_around, stands_at, hit->chain.number);
#else
        if (block_entry != RP_NONE) rp_set_standing(paths, slot, &walk->ray, stands_at, hit->number);
#endif
#endif
        if (block_entry == RP_NONE)
            rp_finish_extension(paths, slot, offset_exponent);
        else
            rp_wait_for_block(paths, slot, rp_block_entry_block(geometry, block_entry), rp_extension_waits(offset_exponent, 0u), demand, block_count);
    }
#ifdef RP_TRACK_BOUNCES
    if (block_entry == RP_NONE && hit->found_in != RP_NONE) rp_note_bounce(demand, block_count, hit->found_in);
#endif
}

__kernel void rp_extend(RP_GEOMETRY_PARAMETERS, uint block_count, uint round, uint slot_count, const __global uint* restrict queue,
                        __global uint* restrict status, __global uint4* restrict planes,
                        volatile __global uint* restrict counters RP_VISIT_PARAMETER) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    const rp_paths paths = {slot_count, status, planes};
    const uint count = counters[RP_COUNT_EXTEND];
    __local uint totals[2];
    uint mine[2] = {0u, 0u};
    rp_begin_totals(totals, 2u);
    rp_closest_walk walk;
    uint2 stack[RP_STACK_SIZE];
#ifdef RP_SHARED_STACK
    // REQUIRES: groups of RP_GROUP_SIZE. Not said by an attribute, with which NVIDIA's compiler forgets the most registers that it may use.
    __local uint2 shared[RP_SHARED_STACK * RP_GROUP_SIZE];
    walk.shared = shared + get_local_id(0);
#endif
#ifdef RP_PERSISTENT
    const uint parts = rp_part_count();
    volatile __global uint* const taken = counters + RP_COUNT_EXTEND_TAKEN;
    bool under_way = false;
    uint slot = 0u, part = rp_own_part(parts);
    walk.current = RP_REF_EXIT;
    for (;;) {
        const bool ended = walk.current >= RP_REF_STOPPED;
        if (ended && under_way) {
            rp_put_down(&geometry, &walk, block_count, demand, &paths, slot, mine);
            under_way = false;
        }
        const bool wanted = ended && part != RP_NONE;
        const uint i = rp_part_position(rp_take_numbers(wanted, taken + part), part, parts);
        if (rp_ballot(wanted && i >= count) != 0u) part = rp_next_part(taken, part, parts, count);
        if (wanted && i < count) {
            under_way = true;
            slot = rp_extend_entry(queue, i);
            rp_take_up(&geometry, &walk, stack, &paths, slot);
        }
        // A walk can end where it begins: in an empty scene.
        if (rp_ballot(under_way) == 0u && part == RP_NONE) break;
        rp_traverse_closest(&geometry, &walk, stack, round);
    }
#else
    for (uint i = get_global_id(0); i < count; i += get_global_size(0)) {
        const uint slot = rp_extend_entry(queue, i);
        rp_take_up(&geometry, &walk, stack, &paths, slot);
#ifdef RP_RECORD
        if (!rp_visit_begin(&walk.visits, &geometry, visit_words, demand, block_count, &paths, slot, RP_VISIT_BEGIN_EXTEND, RP_VISIT_RESUME_EXTEND))
            continue;
#endif
        rp_traverse_closest(&geometry, &walk, stack, round);
#ifdef RP_RECORD
        rp_visit_end(&walk.visits, walk.best.found_in);
#endif
        rp_put_down(&geometry, &walk, block_count, demand, &paths, slot, mine);
    }
#endif
    rp_add_totals(totals, mine, 2u, counters + RP_COUNT_REQUESTS_SERVED);
}
