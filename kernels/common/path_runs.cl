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
#define RP_RUN_WORDS (RP_RUN_U + 3u)  // the first of what follows
#else
#define RP_RUN_WORDS RP_RUN_U
#endif
#define RP_RUN(paths, run, slot) (paths)->status[(run) * (size_t)RP_STATUS_WORDS((paths)->slot_count) + (slot)]

#ifdef RP_VERTEX_COLORS
static inline uint rp_color_of(const rp_paths* paths, uint slot) { return RP_RUN(paths, RP_RUN_COLOR, slot); }
static inline void rp_set_color(const rp_paths* paths, uint slot, uint color) { RP_RUN(paths, RP_RUN_COLOR, slot) = color; }
#endif

#ifdef RP_UVS
// See rp_texture_place in shading/surface.cl.
static inline float2 rp_uv_of(const rp_paths* paths, uint slot) {
    return (float2)(as_float(RP_RUN(paths, RP_RUN_U, slot)), as_float(RP_RUN(paths, RP_RUN_V, slot)));
}
static inline float rp_density_of(const rp_paths* paths, uint slot) { return as_float(RP_RUN(paths, RP_RUN_DENSITY, slot)); }
static inline void rp_set_uv(const rp_paths* paths, uint slot, float2 uv, float density) {
    RP_RUN(paths, RP_RUN_U, slot) = as_uint(uv.x);
    RP_RUN(paths, RP_RUN_V, slot) = as_uint(uv.y);
    RP_RUN(paths, RP_RUN_DENSITY, slot) = as_uint(density);
}
#endif

#endif
