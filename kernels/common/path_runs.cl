// A part of path_state.cl: what only some scenes keep of the hit of an extension ray. Runs of words lie one after the other behind the two that every
// scene has.
#ifndef RP_PATH_RUNS_CL
#define RP_PATH_RUNS_CL

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
#define RP_RUN_CONE (RP_RUN_WORDS + 1u)
static inline uint rp_traits_of(const rp_paths* paths, uint slot) { return RP_SLOT_WORD(paths, RP_RUN_TRAITS, slot); }
static inline void rp_set_traits(const rp_paths* paths, uint slot, uint number) { RP_SLOT_WORD(paths, RP_RUN_TRAITS, slot) = number; }
#else
#define RP_RUN_CONE RP_RUN_WORDS
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
