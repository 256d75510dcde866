// Third stage: traces the extension rays of the queue until they have found their closest hit or come to an absent block.
#include "lib/connection.cl"
#include "lib/lanes.cl"
#include "lib/path.cl"
#include "lib/surface.cl"

#define RP_ANY_HIT 0
#include "lib/traverse.cl"
#undef RP_ANY_HIT

// Takes up the ray of a slot where it stands.
static inline void rp_take_up(const rp_geometry* geometry, rp_closest_walk* walk, uint2* stack, uint slot_count, uint slot,
                              const __global uint* status, const __global uint4* paths) {
    const uint state = status[slot];
    const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot);
    uint3 direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot).xyz;
    uint portal = RP_NONE;
    walk->best.t = INFINITY;
    walk->best.what = RP_NONE;
    walk->best.found_in = RP_NONE;
    if ((state & RP_STATUS_MASK) == RP_STATUS_EXTEND_WAITS) {
        walk->best.t = as_float(origin.w);
        walk->best.what = RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot).w;
        portal = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot).w;
    } else if (state & RP_STATUS_CONNECTED) {
        direction = RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot).xyz;
    }
    walk->ray = rp_make_ray(as_float3(origin.xyz), as_float3(direction));
    rp_begin_closest(geometry, walk, stack, portal);
}

// The planes of a ray that has to wait are as abi/path.h says, whatever its status word said until now.
static inline void rp_settle(uint slot_count, uint slot, uint state, __global uint4* paths) {
    if (state & RP_STATUS_CAMERA) {
        const uint pixel = RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot).w, sample = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot).w;
        RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot).w = as_uint(INFINITY);
        RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot).w = as_uint(0.0f);
        RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot_count, slot) = (uint4)(as_uint3((float3)(1.0f)), RP_PATH_SPECULAR);
        RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot) = (uint4)((uint3)(0u), pixel);
        RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)((uint3)(0u), RP_NONE);
        RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(0u, 0u, sample, RP_NONE);
    }
    if (state & RP_STATUS_CONNECTED) rp_settle_connection(slot, state, slot_count, paths);
}

// Puts down what became of it. mine: counts of wants served, and of those without a hit.
static inline void rp_put_down(const rp_geometry* geometry, const rp_closest_walk* walk, uint block_count, volatile __global uint* demand, uint slot_count,
                               uint slot, __global uint* status, __global uint4* paths, uint* mine) {
    const rp_hit* hit = &walk->best;
    const uint state = status[slot], portal = rp_closest_portal(walk);
    mine[0] += (walk->shear.axis & (RP_WALK_SERVED | RP_WALK_IN_VAIN)) != 0u;
    mine[1] += (walk->shear.axis & RP_WALK_IN_VAIN) != 0u;
#ifdef RP_SHORT_STATES
    if (portal == RP_NONE) {
        // Shading, which comes next, finds the surface: there all lanes do so at once.
        if (hit->found_in != RP_NONE) {
            const uint plane = state & RP_STATUS_CAMERA ? RP_PLANE_ORIGIN : state & RP_STATUS_CONNECTED ? RP_PLANE_DIRECTION : RP_PLANE_HIT;
            __global uint* const found = (__global uint*)&RP_PLANE(paths, plane, slot_count, slot);
            found[0] = hit->what;
            found[1] = hit->found_in;
            found[2] = as_uint(hit->t);
        }
        status[slot] = (state & ~RP_STATUS_MASK) | RP_STATUS_SHADE | (hit->found_in != RP_NONE ? RP_STATUS_FOUND : 0u);
    } else
#endif
    {
        uint offset_exponent = rp_state_offset(state);
        rp_settle(slot_count, slot, state, paths);
        if (hit->found_in != RP_NONE) {
            // Read again, so that no register keeps it along the walk.
            rp_ray ray = walk->ray;
            ray.direction = as_float3(RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot).xyz);
            const rp_surface s = rp_hit_surface(geometry, &ray, hit);
            offset_exponent = s.offset_exponent;
#ifdef RP_VERTEX_COLORS
            rp_set_color(status, slot_count, slot, s.color);
#endif
            RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot).w = as_uint(hit->t);
            RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)(as_uint3(s.position), rp_hit_primitive(geometry, hit));
            const uint sample = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot).z;
            RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(s.geometric_normal, s.shading_normal, sample, portal);
        } else {
            rp_set_portal(slot, portal, slot_count, paths);
        }
        const uint offset = offset_exponent << RP_STATUS_OFFSET_SHIFT;
        if (portal == RP_NONE)
            status[slot] = RP_STATUS_SHADE | offset;
        else
            rp_wait_for(slot, rp_portal_block(geometry, portal), RP_STATUS_EXTEND_WAITS | offset, slot_count, status,
                        demand + RP_DEMAND_WANTS * block_count);
    }
#ifdef RP_COUNT_BOUNCES
    if (portal == RP_NONE && hit->found_in != RP_NONE) atomic_inc(demand + RP_DEMAND_BOUNCES * block_count + hit->found_in);
#endif
}

__kernel void rp_extend(RP_GEOMETRY_PARAMETERS, uint block_count, uint round, uint slot_count, const __global uint* restrict queue,
                        __global uint* restrict status, __global uint4* restrict paths, volatile __global uint* restrict counters
                            RP_VISIT_PARAMETER) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(demand + RP_DEMAND_USED * block_count);
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
            rp_put_down(&geometry, &walk, block_count, demand, slot_count, slot, status, paths, mine);
            under_way = false;
        }
        const bool wanted = ended && part != RP_NONE;
        const uint i = rp_part_place(rp_take_numbers(wanted, taken + part), part, parts);
        if (rp_ballot(wanted && i >= count) != 0u) part = rp_next_part(taken, part, parts, count);
        if (wanted && i < count) {
            under_way = true;
            slot = rp_extend_entry(queue, i);
            rp_take_up(&geometry, &walk, stack, slot_count, slot, status, paths);
        }
        // A walk can end where it begins: in an empty scene.
        if (rp_ballot(under_way) == 0u && part == RP_NONE) break;
        rp_run_closest(&geometry, &walk, stack, round);
    }
#else
    for (uint i = get_global_id(0); i < count; i += get_global_size(0)) {
        const uint slot = rp_extend_entry(queue, i);
        rp_take_up(&geometry, &walk, stack, slot_count, slot, status, paths);
#ifdef RP_RECORD
        if (!rp_visit_begin(&walk.visits, &geometry, visit_words, demand + RP_DEMAND_WANTS * block_count, slot_count, slot, status[slot], paths,
                            RP_VISIT_BEGIN_EXTEND, RP_VISIT_RESUME_EXTEND))
            continue;
#endif
        rp_run_closest(&geometry, &walk, stack, round);
#ifdef RP_RECORD
        rp_visit_end(&walk.visits, walk.best.found_in);
#endif
        rp_put_down(&geometry, &walk, block_count, demand, slot_count, slot, status, paths, mine);
    }
#endif
    rp_add_totals(totals, mine, 2u, counters + RP_COUNT_WANTS_SERVED);
}
