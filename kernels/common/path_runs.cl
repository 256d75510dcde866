// A part of path_state.cl: what only some scenes keep of the hit of an extension ray. Runs of words lie one after the other behind the two that every
// scene has.
#ifndef RP_PATH_RUNS_CL
#define RP_PATH_RUNS_CL

#ifdef RP_FIRST_HITS
#include "common/arithmetic.cl"
#endif
#if defined(RP_HIT_IDS) && defined(RP_INSTANCES)
#include "raypager/abi/instance.h"
#endif

#define RP_RUN_COLOR 2u
#ifdef RP_VERTEX_COLORS
#define RP_RUN_U 3u
#else
#define RP_RUN_U 2u
#endif
#define RP_RUN_V (RP_RUN_U + 1u)
#define RP_RUN_DENSITY (RP_RUN_U + 2u)
#ifdef RP_UVS
#ifdef RP_TANGENTS
#define RP_RUN_TANGENT (RP_RUN_U + 3u)
#define RP_RUN_WORDS (RP_RUN_U + 4u)  // the first of what follows
#else
#define RP_RUN_WORDS (RP_RUN_U + 3u)
#endif
#else
#define RP_RUN_WORDS RP_RUN_U
#endif
#define RP_SLOT_WORD(paths, run, slot) (paths)->status[(run) * (size_t)RP_STATUS_WORDS((paths)->slot_count) + (slot)]

#ifdef RP_VERTEX_COLORS
static inline uint rp_color_of(const rp_paths* paths, uint slot) { return RP_SLOT_WORD(paths, RP_RUN_COLOR, slot); }
static inline void rp_set_color(const rp_paths* paths, uint slot, uint color) { RP_SLOT_WORD(paths, RP_RUN_COLOR, slot) = color; }
#endif

#ifdef RP_UVS
// See rp_texture_place in shading/surface.cl.
static inline float2 rp_uv_of(const rp_paths* paths, uint slot) {
    return (float2)(as_float(RP_SLOT_WORD(paths, RP_RUN_U, slot)), as_float(RP_SLOT_WORD(paths, RP_RUN_V, slot)));
}
#ifdef RP_TANGENTS
static inline uint rp_tangent_of(const rp_paths* paths, uint slot) { return RP_SLOT_WORD(paths, RP_RUN_TANGENT, slot); }
static inline void rp_set_tangent(const rp_paths* paths, uint slot, uint tangent) { RP_SLOT_WORD(paths, RP_RUN_TANGENT, slot) = tangent; }
#endif
static inline float rp_density_of(const rp_paths* paths, uint slot) { return as_float(RP_SLOT_WORD(paths, RP_RUN_DENSITY, slot)); }
static inline void rp_set_uv(const rp_paths* paths, uint slot, float2 uv, float density) {
    RP_SLOT_WORD(paths, RP_RUN_U, slot) = as_uint(uv.x);
    RP_SLOT_WORD(paths, RP_RUN_V, slot) = as_uint(uv.y);
    RP_SLOT_WORD(paths, RP_RUN_DENSITY, slot) = as_uint(density);
}
#endif

// The number of the traits of the instance that the closest hit is in.
#ifdef RP_TRAITS
#define RP_RUN_TRAITS RP_RUN_WORDS
#define RP_RUN_IDS (RP_RUN_WORDS + 1u)
static inline uint rp_traits_of(const rp_paths* paths, uint slot) { return RP_SLOT_WORD(paths, RP_RUN_TRAITS, slot); }
static inline void rp_set_traits(const rp_paths* paths, uint slot, uint number) { RP_SLOT_WORD(paths, RP_RUN_TRAITS, slot) = number; }
#else
#define RP_RUN_IDS RP_RUN_WORDS
#endif

// The numbers of the instance that the closest hit is in, and of its object, from 1; 0: of none. For layers of the film.
#if defined(RP_HIT_IDS) && defined(RP_INSTANCES)
#define RP_RUN_FIRST_HIT (RP_RUN_IDS + 2u)
static inline uint2 rp_ids_of(const rp_paths* paths, uint slot) {
    return (uint2)(RP_SLOT_WORD(paths, RP_RUN_IDS, slot), RP_SLOT_WORD(paths, RP_RUN_IDS + 1u, slot));
}
// instance: null for a hit in the world.
static inline void rp_set_ids(const rp_paths* paths, uint slot, const __global rp_instance* instance, uint number) {
    RP_SLOT_WORD(paths, RP_RUN_IDS, slot) = number;
    RP_SLOT_WORD(paths, RP_RUN_IDS + 1u, slot) = instance ? instance->object + 1u : 0u;
}
#else
#define RP_RUN_FIRST_HIT RP_RUN_IDS
#endif

// What the camera ray of a path met, for layers of the film: albedo as roots of 10 bits each, and the normal.
#ifdef RP_FIRST_HITS
#define RP_RUN_CONE (RP_RUN_FIRST_HIT + 2u)
#define RP_FIRST_HIT_ANY (1u << 30)
typedef struct rp_first_hit {
    bool any;
    float3 albedo;
    uint normal;
} rp_first_hit;
static inline rp_first_hit rp_first_hit_of(const rp_paths* paths, uint slot) {
    const uint code = RP_SLOT_WORD(paths, RP_RUN_FIRST_HIT, slot);
    const float3 root = (float3)(code & 1023u, code >> 10 & 1023u, code >> 20 & 1023u) / 1023.0f;
    const rp_first_hit hit = {code != 0u, root * root, RP_SLOT_WORD(paths, RP_RUN_FIRST_HIT + 1u, slot)};
    return hit;
}
// albedo: 0 to 1.
static inline void rp_set_first_hit(const rp_paths* paths, uint slot, float3 albedo, uint normal) {
    const float3 exact = sqrt(clamp(albedo, 0.0f, 1.0f));
    const uint3 root = convert_uint3_rtz((float3)(rp_mul(exact.x, 1023.0f), rp_mul(exact.y, 1023.0f), rp_mul(exact.z, 1023.0f)) + 0.5f);
    RP_SLOT_WORD(paths, RP_RUN_FIRST_HIT, slot) = root.x | root.y << 10 | root.z << 20 | RP_FIRST_HIT_ANY;
    RP_SLOT_WORD(paths, RP_RUN_FIRST_HIT + 1u, slot) = normal;
}
static inline void rp_forget_first_hit(const rp_paths* paths, uint slot) { RP_SLOT_WORD(paths, RP_RUN_FIRST_HIT, slot) = 0u; }
#else
#define RP_RUN_CONE RP_RUN_FIRST_HIT
#endif

#ifdef RP_TEXTURES
#ifdef RP_CUTOUTS
#define RP_RUN_LIGHT (RP_RUN_CONE + 1u)
#define RP_RUN_TEXELS (RP_RUN_CONE + 4u)
#else
#define RP_RUN_TEXELS (RP_RUN_CONE + 1u)
#endif
static inline uint rp_texel_word(const rp_paths* paths, uint slot, uint word) { return RP_SLOT_WORD(paths, RP_RUN_TEXELS + word, slot); }
static inline void rp_set_texel_word(const rp_paths* paths, uint slot, uint word, uint texel) {
    RP_SLOT_WORD(paths, RP_RUN_TEXELS + word, slot) = texel;
}

// What a ray stands for: how wide that is where the ray begins, and how much wider per unit of its way. Each is the upper half of a float.
typedef struct rp_cone {
    float width, spread;
} rp_cone;
static inline rp_cone rp_cone_of(const rp_paths* paths, uint slot) {
    const uint word = RP_SLOT_WORD(paths, RP_RUN_CONE, slot);
    const rp_cone cone = {as_float(word << 16), as_float(word & 0xffff0000u)};
    return cone;
}
static inline void rp_set_cone(const rp_paths* paths, uint slot, rp_cone cone) {
    RP_SLOT_WORD(paths, RP_RUN_CONE, slot) = as_uint(cone.width) >> 16 | (as_uint(cone.spread) & 0xffff0000u);
}
#endif

#endif
