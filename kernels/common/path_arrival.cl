// A part of path_state.cl: the end of an extension ray, where it is shaded, or waits to be.
#ifndef RP_PATH_ARRIVAL_CL
#define RP_PATH_ARRIVAL_CL

typedef struct rp_arrival {
    float3 direction, throughput, radiance, position;
    float bsdf_density, distance;
    uint flags, pixel, sample;
    uint primitive, geometric_normal, shading_normal;  // RP_NONE: no hit, and then the others mean nothing
    uint offset_exponent;
#ifdef RP_VERTEX_COLORS
    uint color;
#endif
#ifdef RP_TRAITS
    uint traits;
#endif
#ifdef RP_CUTOUTS
    bool shadow;   // it was a shadow ray
    float passed;  // as RP_PLANE_NEXT has it
#endif
#ifdef RP_UVS
    float2 uv;
    float density;
#ifdef RP_TANGENTS
    uint tangent;
#endif
#endif
#ifdef RP_SHORT_STATES
    // The hit whose surface is still to be found, along the ray from here. block: RP_NONE if there is none.
    float3 origin;
    uint leaf, block;
#endif
} rp_arrival;

// From planes in the full form, but for the distance.
static inline rp_arrival rp_make_arrival(const rp_paths* paths, uint slot, uint status, uint4 direction, uint4 throughput, uint4 radiance, uint4 hit,
                                         uint4 surface, float distance) {
    rp_arrival a;
    a.direction = as_float3(direction.xyz);
    a.bsdf_density = as_float(direction.w);
    a.throughput = as_float3(throughput.xyz);
    a.flags = throughput.w;
    a.radiance = as_float3(radiance.xyz);
    a.pixel = radiance.w;
    a.position = as_float3(hit.xyz);
    a.primitive = hit.w;
    a.geometric_normal = surface.x;
    a.shading_normal = surface.y;
    a.sample = surface.z;
    a.distance = distance;
    a.offset_exponent = rp_offset_exponent_of(status);
#ifdef RP_CUTOUTS
    a.shadow = (a.flags & RP_PATH_SHADOW) != 0u;
    a.passed = status & RP_STATUS_CONNECTED ? 0.0f : as_float(RP_PLANE(paths, RP_PLANE_NEXT, slot).w);
#ifdef RP_SHORT_STATES
    if (status & RP_STATUS_CAMERA) a.passed = 0.0f;
#endif
#endif
#ifdef RP_VERTEX_COLORS
    a.color = rp_color_of(paths, slot);
#endif
#ifdef RP_TRAITS
    a.traits = rp_traits_of(paths, slot);
#endif
#ifdef RP_UVS
#ifdef RP_SHORT_STATES
    if (!(status & RP_STATUS_FOUND))  // else they are still to be found
#endif
    {
        a.uv = rp_uv_of(paths, slot);
        a.density = rp_density_of(paths, slot);
#ifdef RP_TANGENTS
        a.tangent = rp_tangent_of(paths, slot);
#endif
    }
#endif
    return a;
}

#ifdef RP_SHORT_STATES
// eye: of the camera, for camera rays that all begin there.
static inline rp_arrival rp_arrival_of(const rp_paths* paths, uint slot, uint status, float3 eye) {
    uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot), direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot);
    uint4 throughput = (uint4)(0u), radiance = (uint4)(0u), hit = (uint4)(0u), surface = (uint4)(0u);
    if (!(status & RP_STATUS_CAMERA)) {
        throughput = RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot);
        radiance = RP_PLANE(paths, RP_PLANE_RADIANCE, slot);
        hit = RP_PLANE(paths, RP_PLANE_HIT, slot);
        surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot);
    }
    uint3 found = hit.xyz;
    if (status & RP_STATUS_CAMERA) {
        throughput = (uint4)(as_uint3((float3)(1.0f)), RP_PATH_SPECULAR);
        radiance = (uint4)((uint3)(0u), origin.w);
        surface = (uint4)(0u, 0u, direction.w, RP_NONE);
        hit.w = RP_NONE;
        direction.w = as_uint(0.0f);
#ifdef RP_EYE_MOVES
        if (status & RP_STATUS_FOUND) found = RP_PLANE(paths, RP_PLANE_HIT, slot).xyz;
#else
        found = origin.xyz;
        origin.xyz = as_uint3(eye);
#endif
    } else if (status & RP_STATUS_CONNECTED) {
        if (status & RP_STATUS_LIT) radiance.xyz = as_uint3(as_float3(radiance.xyz) + rp_light_in(hit, surface));
        found = direction.xyz;
        direction.xyz = hit.xyz;
        hit.w = RP_NONE;
    }
    const float distance = status & RP_STATUS_FOUND ? as_float(found.z) : as_float(origin.w);
    rp_arrival a = rp_make_arrival(paths, slot, status, direction, throughput, radiance, hit, surface, distance);
    a.origin = as_float3(origin.xyz);
    a.leaf = found.x;
    a.block = status & RP_STATUS_FOUND ? found.y : RP_NONE;
    return a;
}
#else
static inline rp_arrival rp_arrival_of(const rp_paths* paths, uint slot, uint status) {
    const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot), throughput = RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot);
    uint4 direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot), radiance = RP_PLANE(paths, RP_PLANE_RADIANCE, slot);
    uint4 hit = RP_PLANE(paths, RP_PLANE_HIT, slot), surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot);
    uint distance = origin.w;
    if (status & RP_STATUS_CONNECTED) {
        const float3 before = as_float3(radiance.xyz), after = before + rp_light_in(hit, surface);
        radiance.xyz = as_uint3(status & RP_STATUS_LIT ? after : before);
        const uint4 found = direction;
        distance = found.z;
        direction = (uint4)(hit.xyz, found.w);
        hit = origin;
        surface.xy = found.xy;
    }
    return rp_make_arrival(paths, slot, status, direction, throughput, radiance, hit, surface, as_float(distance));
}
#endif

#ifdef RP_TEXTURES
// The path of a slot waits where it has arrived, for a page of a texture; have: a bit for each word of texels that it has. All that arrival is comes
// from the planes in their full form from now on.
static inline uint rp_wait_to_shade(const rp_paths* paths, uint slot, uint status, const rp_arrival* a, uint have) {
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot).w = as_uint(a->distance);
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot) = (uint4)(as_uint3(a->direction), as_uint(a->bsdf_density));
    RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot) = (uint4)(as_uint3(a->throughput), a->flags);
    RP_PLANE(paths, RP_PLANE_RADIANCE, slot) = (uint4)(as_uint3(a->radiance), a->pixel);
    RP_PLANE(paths, RP_PLANE_HIT, slot) = (uint4)(as_uint3(a->position), a->primitive);
    RP_PLANE(paths, RP_PLANE_SURFACE, slot) = (uint4)(a->geometric_normal, a->shading_normal, a->sample, have);
#ifdef RP_CUTOUTS
    rp_set_passed(paths, slot, a->passed);
#endif
#ifdef RP_VERTEX_COLORS
    rp_set_color(paths, slot, a->color);
#endif
#ifdef RP_UVS
    rp_set_uv(paths, slot, a->uv, a->density);
#ifdef RP_TANGENTS
    rp_set_tangent(paths, slot, a->tangent);
#endif
#endif
#ifdef RP_SHORT_STATES
    const uint last_block = 0u;
#else
    const uint last_block = status & RP_STATUS_BLOCK_MASK;
#endif
    return RP_PHASE_SHADE_WAITS | a->offset_exponent << RP_STATUS_OFFSET_SHIFT | last_block;
}
// Which texels a path has that had waited.
static inline uint rp_texels_had(const rp_paths* paths, uint slot) { return rp_block_entry_of(paths, slot); }
#endif

#endif
