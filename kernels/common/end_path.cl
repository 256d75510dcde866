// The end of a path: its sample joins the film.
#ifndef RP_END_PATH_CL
#define RP_END_PATH_CL

#include "common/film.cl"
#include "common/path_state.cl"
#ifdef RP_FIRST_HITS
#include "common/normal.cl"
#endif

#ifdef RP_FIRST_HITS
// Sums in fixed point, as those of light. A normal may be longer than 1 by a rounding error.
static inline void rp_add_to_layer(volatile __global uint* words, float3 value) {
    rp_film_add_channel(words, rp_max(value.x, 0.0f));
    rp_film_add_channel(words + 2, rp_max(value.y, 0.0f));
    rp_film_add_channel(words + 4, rp_max(value.z, 0.0f));
}

// Only now: what is traced again from its camera on, after a checkpoint, must not be added twice.
static inline void rp_film_add_first_hit(volatile __global uint* words, const rp_paths* paths, uint slot) {
    const rp_first_hit hit = rp_first_hit_of(paths, slot);
    if (!hit.any) return;
#ifdef RP_LAYER_ALBEDO
    rp_add_to_layer(words + RP_LAYER_ALBEDO, hit.albedo);
#endif
#ifdef RP_LAYER_NORMAL
    rp_add_to_layer(words + RP_LAYER_NORMAL, 0.5f * rp_decode_normal(hit.normal) + 0.5f);
    atomic_inc(words + RP_LAYER_NORMAL + RP_NORMAL_LAYER_COUNT);
#endif
}
#endif

static inline void rp_add_sample(__constant rp_render_params* params, const rp_paths* paths, uint slot, __global uint* film, uint pixel,
                                 float3 radiance) {
    volatile __global uint* words = rp_film_pixel(params, film, pixel);
    rp_film_add(words, rp_film_limit(radiance, params->max_luminance, params->max_xyz));
#ifdef RP_FIRST_HITS
    rp_film_add_first_hit(words, paths, slot);
#endif
}

#endif
