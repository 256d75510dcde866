// Adds a finished sample to the film: fixed point, so that the sum does not depend on the order (abi/film.h).
#ifndef RP_FILM_CL
#define RP_FILM_CL

#include "common/arithmetic.cl"
#include "raypager/abi/film.h"
#include "raypager/abi/scene.h"

#ifndef RP_FILM_STRIDE
#define RP_FILM_STRIDE RP_FILM_WORDS
#endif
// REQUIRES: the film of its row is on the device.
static inline volatile __global uint* rp_film_pixel(__constant rp_render_params* params, __global uint* film, uint pixel) {
    return film + (size_t)(pixel - params->film_first_row * params->width) * RP_FILM_STRIDE;
}

// words: of a channel. Radiance <= 2^20 in units of 2^-28 is a whole number of up to 48 bits; its upper part counts 2^32 such units = 2^4. All steps
// are exact but for the final truncation: v / 16 and its floor are exact, so is the remainder, and 2^28 is a power of two.
static inline void rp_film_add_channel(volatile __global uint* words, float v) {
    const float upper = floor(v * 0.0625f);
    const uint high = (uint)upper, low = (uint)((v - upper * 16.0f) * 268435456.0f);
    const uint before = low != 0u ? atomic_add(words, low) : 0u;
    const uint carry = low != 0u && before + low < before ? 1u : 0u;
    if (high + carry != 0u) atomic_add(words + 1, high + carry);
}

// A sample that is too bright is scaled down as a whole, so that it keeps its hue. Without limits, which are infinite then, nothing is.
static inline float3 rp_film_limit(float3 radiance, float max_luminance, float max_xyz) {
    if (max_luminance == INFINITY && max_xyz == INFINITY) return radiance;
    const float x = dot(radiance, (float3)(0.4124564f, 0.3575761f, 0.1804375f));
    const float y = dot(radiance, (float3)(0.2126729f, 0.7151522f, 0.0721750f));
    const float z = dot(radiance, (float3)(0.0193339f, 0.1191920f, 0.9503041f));
    const float largest = fmax(y, fmax(x, z));
    float scale = 1.0f;
    if (y > max_luminance) scale = max_luminance / y;
    if (largest * scale > max_xyz) scale = max_xyz / largest;
    return radiance * scale;
}

// words: of a pixel.
static inline void rp_film_add(volatile __global uint* words, float3 radiance) {
    const float3 clamped =
        (float3)(radiance.x > 0.0f ? fmin(radiance.x, RP_FILM_MAX_RADIANCE) : 0.0f, radiance.y > 0.0f ? fmin(radiance.y, RP_FILM_MAX_RADIANCE) : 0.0f,
                 radiance.z > 0.0f ? fmin(radiance.z, RP_FILM_MAX_RADIANCE) : 0.0f);
    if (any(isnotequal(clamped, radiance)) || any(isnan(radiance))) atomic_inc(words + RP_FILM_CLAMPED);
    rp_film_add_channel(words, clamped.x);
    rp_film_add_channel(words + 2, clamped.y);
    rp_film_add_channel(words + 4, clamped.z);
#ifdef RP_LAYER_VARIANCE
    const float luminance = rp_add(rp_add(rp_mul(0.2126729f, clamped.x), rp_mul(0.7151522f, clamped.y)), rp_mul(0.0721750f, clamped.z));
    const float bright = rp_min(luminance, RP_VARIANCE_MAX_LUMINANCE);
    rp_film_add_channel(words + RP_LAYER_VARIANCE, rp_mul(bright, bright));
#endif
    atomic_inc(words + RP_FILM_COUNT);
}

// The camera ray of a sample met nothing, and what is behind is to be transparent.
static inline void rp_film_add_miss(volatile __global uint* words) { atomic_add(words + RP_FILM_COUNT, 1u << RP_FILM_MISSES_SHIFT); }

#endif
