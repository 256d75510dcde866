// What becomes of a path when its shadow ray has been traced as far as it gets.
#ifndef RP_CONNECTION_CL
#define RP_CONNECTION_CL

#include "lib/film.cl"
#include "lib/path.cl"
#include "raypager/abi/block.h"

// Adds the light that arrives; the path ends, or its extension ray begins.
static inline void rp_finish_connection(uint slot, bool occluded, uint slot_count, __global uint* status, __global uint4* paths,
                                        __global uint* film) {
    const uint4 hit = RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot), radiance_plane = RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot);
    const uint4 surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot);
    float3 radiance = as_float3(radiance_plane.xyz);
    if (!occluded) radiance += (float3)(as_float(hit.w), as_float(surface.x), as_float(surface.y));
    if (RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot_count, slot).w & RP_PATH_ENDS) {
        rp_film_add(film, radiance_plane.w, radiance);
        status[slot] = RP_STATUS_FREE;
        return;
    }
    const uint density = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot).w;
    RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot) = (uint4)(as_uint3(radiance), radiance_plane.w);
    ((__global float*)&RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot))[3] = INFINITY;
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot) = (uint4)(hit.xyz, density);
    RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)((uint3)(0u), RP_NONE);
    RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(0u, 0u, surface.z, RP_NONE);
    status[slot] = RP_STATUS_EXTEND | (status[slot] & RP_STATUS_BLOCK_MASK);
}

#endif
