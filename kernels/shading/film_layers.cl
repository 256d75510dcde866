// Layers of the film that say what a camera ray meets first (raypager/abi/film.h, raypager/film_layers.hpp).
#ifndef RP_FILM_LAYERS_CL
#define RP_FILM_LAYERS_CL

#if defined(RP_FIRST_HITS) || defined(RP_LAYER_DEPTH) || defined(RP_LAYER_POSITION) || defined(RP_HIT_IDS) || defined(RP_LAYER_MATERIAL)
#define RP_FIRST_HIT_LAYERS

#ifdef RP_FIRST_HITS
// What a conductor reflects of light that falls on it straight.
static inline float3 rp_straight_reflectance(float3 eta, float3 k) {
    const float3 less = eta - 1.0f, more = eta + 1.0f, squared = k * k;
    return (less * less + squared) / (more * more + squared);
}

// The share of light that a surface reflects or lets through, whatever its roughness. reflectance: diffuse, where the path has arrived.
static inline float3 rp_albedo(RP_MATERIAL_SPACE const rp_material* material, float3 reflectance) {
    const float3 eta = (float3)(material->eta[0], material->eta[1], material->eta[2]), k = (float3)(material->k[0], material->k[1], material->k[2]);
    switch (material->kind) {
        case RP_MATERIAL_DIFFUSE:
            return reflectance;
        case RP_MATERIAL_CONDUCTOR:
            return rp_straight_reflectance(eta, k);
        case RP_MATERIAL_DIELECTRIC:
            return (float3)(1.0f);
#ifdef RP_LAYERED
        case RP_MATERIAL_LAYERED: {
            const float3 specular = (float3)(material->specular[0], material->specular[1], material->specular[2]);
            const float3 mirror = (float3)(material->mirror[0], material->mirror[1], material->mirror[2]);
            const float3 refracted = (float3)(material->refracted[0], material->refracted[1], material->refracted[2]);
            const float3 transmittance = (float3)(material->transmittance[0], material->transmittance[1], material->transmittance[2]);
            const float3 base = material->flags & RP_MATERIAL_METAL_BASE ? rp_straight_reflectance(eta, k) : reflectance + transmittance;
            if (material->flags & (RP_MATERIAL_BLEND | RP_MATERIAL_SCHLICK)) return base + specular * (1.0f - base);
            const float root = (material->ior - 1.0f) / (material->ior + 1.0f);
            const float straight = root * root;
            return straight * mirror + (1.0f - straight) * (refracted + base);
        }
#endif
        default:
            return (float3)(0.0f);
    }
}
#endif

#ifdef RP_LAYER_DEPTH
static inline float rp_dot_apart(float3 a, float3 b) { return rp_add(rp_add(rp_mul(a.x, b.x), rp_mul(a.y, b.y)), rp_mul(a.z, b.z)); }
#endif

// words: of the film's pixel. vertex: the first of a path. ids: of the hit, as rp_ids_of has them. material_number: of the scene.
static inline void rp_keep_first_hit(volatile __global uint* words, const __constant rp_camera* camera, const rp_paths* paths, uint slot,
                                     const rp_vertex_1* vertex, RP_MATERIAL_SPACE const rp_material* material, float distance, uint2 ids,
                                     uint material_number) {
    const float3 direction = rp_float3(vertex->direction);
#ifdef RP_FIRST_HITS
    const float3 outside = rp_decode_normal(vertex->shading_normal);
    rp_set_first_hit(paths, slot, rp_albedo(material, rp_float3(vertex->reflectance)),
                     dot(outside, direction) > 0.0f ? rp_encode_normal(-outside) : vertex->shading_normal);
#endif
    if (vertex->sample != 0u) return;
        // One work-item writes these: of each pixel there is one first sample. However often it is traced, they are the same.
#ifdef RP_LAYER_DEPTH
    // Not fused in one kernel and rounded in another.
    const float3 forward = (float3)(camera->forward[0], camera->forward[1], camera->forward[2]);
    const float along = rp_div(rp_dot_apart(forward, direction), rp_sqrt(rp_dot_apart(forward, forward)));
    const bool planar = camera->projection == RP_PROJECTION_PERSPECTIVE || camera->projection == RP_PROJECTION_ORTHOGRAPHIC;
    words[RP_LAYER_DEPTH] = as_uint(planar ? rp_mul(distance, along) : distance);
#endif
#ifdef RP_LAYER_POSITION
    words[RP_LAYER_POSITION] = as_uint(vertex->position.x);
    words[RP_LAYER_POSITION + 1] = as_uint(vertex->position.y);
    words[RP_LAYER_POSITION + 2] = as_uint(vertex->position.z);
#endif
#ifdef RP_LAYER_OBJECT
    words[RP_LAYER_OBJECT] = ids.y;
#endif
#ifdef RP_LAYER_INSTANCE
    words[RP_LAYER_INSTANCE] = ids.x;
#endif
#ifdef RP_LAYER_MATERIAL
    words[RP_LAYER_MATERIAL] = material_number + 1u;
#endif
}
#endif

#endif
