// Light from all around by an image (abi/light_image.h): where a direction lies on it, what shines there, and how directions are drawn in proportion
// to that. One lane alone: rays that leave a scene are few, and neighbours look to different places.
#ifndef RP_SKY_CL
#define RP_SKY_CL

#include "common/angles.cl"
#include "raypager/abi/light_image.h"

// The light's p, e1 and e2 are the axes of its image in the world. Its words come behind those by which lights are chosen.
static inline const __global uint* rp_sky_words(const __global rp_light* light, const __global uint* light_steps) {
    return light_steps + as_uint(light->area);
}
static inline float3 rp_sky_to_world(const __global rp_light* light, float3 d) {
    return d.x * rp_load3(light->p) + d.y * rp_load3(light->e1) + d.z * rp_load3(light->e2);
}
static inline float3 rp_sky_from_world(const __global rp_light* light, float3 d) {
    return (float3)(dot(rp_load3(light->p), d), dot(rp_load3(light->e1), d), dot(rp_load3(light->e2), d));
}

// The place on the image, in [0, 1]^2, of a unit direction in the space of the image.
static inline float2 rp_sky_place(float3 d) {
    const float x = fabs(d.x), y = fabs(d.y), most = rp_max(x, y);
    // The root of 1 - |z|, which would lose all its digits near the poles.
    const float r = sqrt((x * x + y * y) / (1.0f + fabs(d.z)));
    const float part = rp_atan_quarters(most > 0.0f ? rp_min(x, y) / most : 0.0f), turn = x < y ? 1.0f - part : part;
    const float v = turn * r, u = r - v;
    const bool below = d.z < 0.0f;
    return (float2)(copysign(below ? 1.0f - v : u, d.x), copysign(below ? 1.0f - u : v, d.y)) * 0.5f + 0.5f;
}

static inline float3 rp_sky_direction(float2 place) {
    const float u = 2.0f * place.x - 1.0f, v = 2.0f * place.y - 1.0f, to_horizon = 1.0f - (fabs(u) + fabs(v)), r = 1.0f - fabs(to_horizon);
    const float turns = r > 0.0f ? ((fabs(v) - fabs(u)) / r + 1.0f) * 0.125f : 0.125f;
    float sine, cosine;
    rp_sincos_turns_1(turns, &sine, &cosine);
    const float across = r * sqrt(2.0f - r * r);
    return (float3)(copysign(cosine * across, u), copysign(sine * across, v), copysign(1.0f - r * r, to_horizon));
}

static inline float3 rp_texel_color(uint2 words, uint exponent) {
    return (float3)((float)(words.x & 0xffffu), (float)(words.x >> 16), (float)(words.y & 0xffffu)) * as_float(exponent << 23);
}

// The one place that knows where texels are, but for those in pages (paged_sky.cl).
static inline float3 rp_image_texel(const __global uint* image, int x, int y) {
    const uint cells = image[RP_IMAGE_CELLS], texel = (uint)y * image[RP_IMAGE_WIDTH] + (uint)x;
    const uint2 words = vload2(texel, image + RP_IMAGE_HEAD + cells + cells * cells);
    return rp_texel_color(words, words.y >> 16);
}

// x, y: from -1 to the number of texels a side. Each edge meets itself, halves swapped.
static inline int2 rp_sky_folded(int x, int y, int size) {
    const int last = size - 1;
    if (x < 0 || x > last) {
        x = x < 0 ? 0 : last;
        y = last - y;
    }
    if (y < 0 || y > last) {
        y = y < 0 ? 0 : last;
        x = last - x;
    }
    return (int2)(x, y);
}
static inline float3 rp_sky_texel(const __global uint* sky, int x, int y) {
    const int2 texel = rp_sky_folded(x, y, (int)sky[RP_IMAGE_WIDTH]);
    return rp_image_texel(sky, texel.x, texel.y);
}

// What shines at a place of the image.
static inline float3 rp_sky_radiance(const __global uint* sky, float2 place) {
    const float2 at = place * (float)sky[RP_IMAGE_WIDTH] - 0.5f, corner = floor(at), f = at - corner;
    const int x = (int)corner.x, y = (int)corner.y;
    const float3 upper = rp_sky_texel(sky, x, y) * (1.0f - f.x) + rp_sky_texel(sky, x + 1, y) * f.x;
    const float3 lower = rp_sky_texel(sky, x, y + 1) * (1.0f - f.x) + rp_sky_texel(sky, x + 1, y + 1) * f.x;
    return upper * (1.0f - f.y) + lower * f.y;
}

// The probability of item i of a choice.
static inline float rp_step_share(const __global uint* steps, uint i) {
    return ((float)(steps[i] - (i == 0u ? 0u : steps[i - 1u] + 1u)) + 1.0f) * 0x1p-32f;
}

// Density by solid angle with which a cell's points are drawn.
static inline float rp_sky_cell_density(const __global uint* sky, uint column, uint row) {
    const uint cells = sky[RP_IMAGE_CELLS];
    const __global uint* rows = sky + RP_IMAGE_HEAD;
    return rp_step_share(rows, row) * rp_step_share(rows + cells + row * cells, column) * (float)(cells * cells) * (0.25f * RP_INV_PI);
}
static inline float rp_sky_density(const __global uint* sky, float2 place) {
    const uint cells = sky[RP_IMAGE_CELLS];
    const float2 at = place * (float)cells;
    return rp_sky_cell_density(sky, min((uint)at.x, cells - 1u), min((uint)at.y, cells - 1u));
}

// A place on the image. number: random; u, fine: in [0, 1), fine only for digits that the others lack.
static inline float2 rp_sample_sky(const __global uint* sky, uint number, float u, float fine, float* density) {
    const uint cells = sky[RP_IMAGE_CELLS];
    const __global uint* rows = sky + RP_IMAGE_HEAD;
    float in_row, in_column;
    const uint row = rp_choose_light(rows, cells, number, fine, &in_row);
    const uint column = rp_choose_light(rows + cells + row * cells, cells, (uint)(u * 0x1p32f), fine, &in_column);
    *density = rp_sky_cell_density(sky, column, row);
    return (float2)((float)column + in_column, (float)row + in_row) / (float)cells;
}

#endif
