// What becomes of a path behind its shadow ray.
#ifndef RP_CONNECTION_CL
#define RP_CONNECTION_CL

#include "lib/film.cl"
#include "lib/path.cl"

static inline float3 rp_light_on_its_way(uint slot, uint slot_count, const __global uint4* paths) {
    return rp_light_in(RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot), RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot));
}

// The shadow ray has been traced: the path ends, or its extension ray begins, which the planes will show when that has been traced
// (RP_STATUS_CONNECTED). state: of the slot; kept: what stays of it.
static inline void rp_end_shadow_ray(uint slot, uint state, uint kept, bool occluded, uint slot_count, __global uint* status,
                                     const __global uint4* paths, __global uint* film) {
    if (!(state & RP_STATUS_ENDS)) {
        status[slot] = RP_STATUS_EXTEND | RP_STATUS_CONNECTED | (occluded ? 0u : RP_STATUS_LIT) | (state & kept);
        return;
    }
    const uint4 radiance = RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot);
    rp_film_add(film, radiance.w, occluded ? as_float3(radiance.xyz) : as_float3(radiance.xyz) + rp_light_on_its_way(slot, slot_count, paths));
    status[slot] = RP_STATUS_FREE;
}

// The planes of an extension ray that is CONNECTED, but can be no longer, are as those of one that is not. It has no hit yet.
static inline void rp_settle_connection(uint slot, uint state, uint slot_count, __global uint4* paths) {
    if (state & RP_STATUS_LIT) {
        const uint4 radiance = RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot);
        const float3 sum = as_float3(radiance.xyz) + rp_light_on_its_way(slot, slot_count, paths);
        RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot) = (uint4)(as_uint3(sum), radiance.w);
    }
    const uint density = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot).w;
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot) = (uint4)(RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot).xyz, density);
    RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot).w = RP_NONE;
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot).w = as_uint(INFINITY);
}

#endif
