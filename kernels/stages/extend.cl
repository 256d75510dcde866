// Third stage: traces the extension rays of the queue until they have found their closest hit or come to an absent block.
#include "lib/path.cl"
#include "lib/surface.cl"

#define RP_ANY_HIT 0
#include "lib/traverse.cl"
#undef RP_ANY_HIT

static inline void rp_extend_ray(const rp_geometry* geometry, volatile __global uint* bounces, uint round, uint slot_count, uint slot,
                                 __global uint* status, __global uint4* paths, volatile __global uint* counters) {
    const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot), direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot);
    const uint4 surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot);
    const rp_ray ray = rp_make_ray(as_float3(origin.xyz), as_float3(direction.xyz));
    rp_hit hit;
    hit.t = as_float(origin.w);
    hit.primitive = RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot).w;
    hit.ref = 0u;
    hit.found_in = RP_NONE;
    uint served;
    const uint portal = rp_find_closest(geometry, &ray, &hit, surface.w, round, &served);
    uint offset_exponent = status[slot] >> RP_STATUS_ROUND_SHIFT;
    if (hit.found_in != RP_NONE) {
        const rp_surface s = rp_hit_surface(geometry, &ray, &hit);
        offset_exponent = s.offset_exponent;
        ((__global float*)&RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot))[3] = hit.t;
        RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)(as_uint3(s.position), hit.primitive);
        RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(s.geometric_normal, s.shading_normal, surface.z, portal);
    } else if (portal != surface.w) {
        ((__global uint*)&RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot))[3] = portal;
    }
    if (served != 0u) {
        rp_count_add(counters + RP_COUNT_WANTS_SERVED, 1u);
        if (served == 2u) rp_count_add(counters + RP_COUNT_WANTS_NO_HIT, 1u);
    }
    // The offset exponent rides in the upper bits, where shadow rays keep their round.
    const uint phase = portal == RP_NONE ? RP_STATUS_SHADE : RP_STATUS_EXTEND;
    status[slot] = phase | offset_exponent << RP_STATUS_ROUND_SHIFT;
    if (phase == RP_STATUS_SHADE) {
        atomic_inc(counters + RP_COUNT_SHADE);
        if (hit.found_in != RP_NONE) {
            const __global rp_block_header* header = (const __global rp_block_header*)rp_block_address(geometry, hit.found_in);
            atomic_inc(bounces + header->block_index);
        }
    }
}

__kernel void rp_extend(RP_GEOMETRY_PARAMETERS, uint block_count, uint round, uint slot_count, const __global uint* restrict queue,
                        __global uint* restrict status, __global uint4* restrict paths, volatile __global uint* restrict counters) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(demand + RP_DEMAND_USED * block_count);
    const uint count = counters[RP_COUNT_EXTEND];
    for (uint i = get_global_id(0); i < count; i += get_global_size(0))
        rp_extend_ray(&geometry, demand + RP_DEMAND_BOUNCES * block_count, round, slot_count, rp_extend_entry(queue, i), status, paths, counters);
}
