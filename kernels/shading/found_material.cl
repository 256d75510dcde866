// A part of shade.cl: the material that a path finds where it has arrived, when textures and cut-outs have had their say.
#ifndef RP_FOUND_MATERIAL_CL
#define RP_FOUND_MATERIAL_CL

// Where the random numbers of a vertex choose texels, and how much of the surface a path stands for there: between that along the slope and across
// it, since the samples of a pixel spread along it by themselves.
static inline rp_texture_site rp_texture_site_of(__constant rp_render_params* params, const rp_arrival* a, uint depth, rp_cone cone, uint flips) {
    rp_texture_site site;
    site.position = a->position;
    site.normal = rp_decode_normal(a->geometric_normal);
#ifdef RP_UVS
    site.uv = a->uv;
    site.density = a->density;
#else
    site.uv = (float2)(0.0f);
    site.density = 0.0f;
#endif
    const float cosine = rp_max(fabs(dot(site.normal, a->direction)), 0.01f);
    site.width = cone.width / sqrt(cosine);
    site.pixel = a->pixel;
    site.sample = a->sample;
    site.depth = depth + 1u;
    site.seed = params->seed;
    site.flips = flips;
#ifdef RP_BUMPS
    site.shading_normal = a->shading_normal;
    const float3 n = rp_decode_normal(a->shading_normal);
#ifdef RP_TANGENTS
    const float3 given = a->tangent != RP_NONE ? rp_decode_normal(a->tangent) : (float3)(0.0f), along = given - dot(given, n) * n;
#else
    const float3 along = (float3)(0.0f);
#endif
    const rp_frame_1 frame = rp_make_frame_1(rp_vector_of(-n), rp_encode_normal(n), rp_encode_normal(n));
    const float length = dot(along, along);
    site.tangent = length > 1e-8f ? along / sqrt(length) : rp_float3(frame.tangent);
    site.bitangent = cross(n, site.tangent);
    site.shading = n;
#endif
    return site;
}

#ifdef RP_CUTOUTS
// Flips of random numbers where a ray arrives, so that what it passes there does not depend on what it has passed before.
static inline uint rp_flips_at(const rp_arrival* a) {
    if (!a->shadow && a->passed == 0.0f) return 0u;
    const rp_numbers_1 hash = rp_hash_1(as_uint(a->position.x), as_uint(a->position.y), as_uint(a->position.z), a->primitive);
    return hash.x;
}
#endif

// What rp_find_material finds: the material; that the path waits for a page; that there is nothing, and the ray passes.
#ifdef RP_CUTOUTS
#define RP_IS_SHADOW(arrival) (arrival)->shadow
#else
#define RP_IS_SHADOW(arrival) false
#endif
#define RP_FOUND_MATERIAL 0
#define RP_FOUND_WAIT 1
#define RP_FOUND_NOTHING 2

// The material with this number where the path has arrived, mixes resolved and textures looked up. resumed: it had waited for a page.
static inline int rp_find_material(const rp_textures* t, __constant rp_render_params* params, const __global rp_material* materials, uint number,
                                   const rp_arrival* a, const rp_paths* paths, uint slot, uint status, bool resumed, rp_material* own,
#ifdef RP_SKY_PAGED
                                   rp_vector_1* sky,
#endif
                                   uint* shading_normal) {
    const uint depth = rp_depth_of(a->flags);
    *shading_normal = a->shading_normal;
    rp_cone cone = {params->textures.cone_width, params->textures.cone_spread};
#ifdef RP_CUTOUTS
    if (depth != 0u || a->passed != 0.0f) cone = rp_cone_of(paths, slot);
    // Numbers of their own for each place: a ray may pass many, and a sphere twice.
    const uint flips = rp_flips_at(a);
#else
    if (depth != 0u) cone = rp_cone_of(paths, slot);
    const uint flips = 0u;
#endif
    cone.width += cone.spread * a->distance;
    uint have = resumed ? rp_texels_had(paths, slot) : 0u;
    bool site_known = false;
    rp_texture_site site;
    for (uint i = 0u;; i++) {
        const __global rp_material* const given = materials + number;
        own->kind = given->kind;
        own->flags = given->flags;
        const bool textured = given->flags >> RP_MATERIAL_PROGRAM_SHIFT != 0u;
        if (given->kind == RP_MATERIAL_DIFFUSE)
            for (uint k = 0u; k < 3u; k++) own->color[k] = given->color[k];
        else
            *own = *given;
        if (textured) {
            if (!site_known) site = rp_texture_site_of(params, a, depth, cone, flips);
            site_known = true;
            // Cut-outs are as sharp as their image.
            const float width = site.width;
            if (given->kind == RP_MATERIAL_MIX && given->first == RP_NONE) site.width = 0.0f;
            uint absent;
            if (!rp_run_program(t, &site, paths, slot, &have, &absent, own)) {
                rp_await_page(t, paths, slot, rp_wait_to_shade(paths, slot, status, a, have), absent);
                return RP_FOUND_WAIT;
            }
            site.width = width;
#ifdef RP_BUMPS
            *shading_normal = site.shading_normal;
#endif
        }
#ifdef RP_LAYERED
        if (own->kind == RP_MATERIAL_MIX && i < RP_MAX_MIXES) {
            number = rp_chosen_of_mix(
                own, rp_mix_numbers(params, a->pixel, a->sample, depth, RP_IS_SHADOW(a) ? RP_RANDOM_SHADOW : RP_RANDOM_MIX) ^ flips, i);
            if (number != RP_NONE) continue;
            if (!RP_IS_SHADOW(a)) rp_set_cone(paths, slot, cone);
            return RP_FOUND_NOTHING;
        }
#endif
        break;
    }
#ifdef RP_SKY_PAGED
    // Last, so that this texel need not be kept while the path waits, and before the cone goes on.
    uint absent;
    if (!RP_IS_SHADOW(a) && depth < params->max_depth && !rp_connect_to_sky(t, params, a, own, sky, &absent)) {
        rp_await_page(t, paths, slot, rp_wait_to_shade(paths, slot, status, a, have), absent);
        return RP_FOUND_WAIT;
    }
#endif
    if (!RP_IS_SHADOW(a)) rp_set_cone(paths, slot, cone);
    return RP_FOUND_MATERIAL;
}

#endif
