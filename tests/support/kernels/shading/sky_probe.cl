// For tests: lookups in a sky whose texels are in pages, outside of paths. Built with RP_TEXTURES, RP_SHORT_STATES, RP_SKY, RP_SKY_PAGED and one
// slab.
#include "shading/surface.cl"
#include "shading/paged_sky.cl"

#define RP_PROBE_TABLES                                                                                             \
    const __global uint4 *restrict pages, const __global uchar *restrict slab, const __global uint *restrict words, \
        __constant rp_texture_tables *restrict at, const __global uint *restrict sky
#define RP_PROBE_MAKE_TEXTURES \
    rp_geometry geometry;      \
    geometry.pages = pages;    \
    geometry.slab0 = slab;     \
    const rp_textures textures = {&geometry, words, at, 0, 0, 0u, 0u, 0, sky};

// items: place, level, 0; two random numbers. results: the texel's colour, and the page that is absent or RP_NONE.
__kernel void rp_probe_sky_texels(RP_PROBE_TABLES, const __global uint4* restrict items, uint count, __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    RP_PROBE_MAKE_TEXTURES
    const uint4 a = items[2u * i], b = items[2u * i + 1u];
    const rp_numbers_1 bits = {b.x, b.y, 0u, 0u};
    float3 color = (float3)(0.0f);
    uint absent = RP_NONE;
    rp_look_at_sky(&textures, sky, as_float2(a.xy), a.z, &bits, &color, &absent);
    results[i] = (float4)(color, as_float(absent));
}

// items: place, level, samples. results: the mean, by the random numbers of pixel i.
__kernel void rp_probe_sky_means(RP_PROBE_TABLES, const __global uint4* restrict items, uint count, __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    RP_PROBE_MAKE_TEXTURES
    const uint4 a = items[i];
    float3 sum = (float3)(0.0f);
    for (uint sample = 0u; sample < a.w; sample++) {
        const rp_numbers_1 bits = rp_random_bits_1(i, sample, 1u, RP_RANDOM_SKY, 0u);
        float3 color;
        uint absent;
        rp_look_at_sky(&textures, sky, as_float2(a.xy), a.z, &bits, &color, &absent);
        sum += color;
    }
    results[i] = (float4)(sum / (float)a.w, 0.0f);
}

// items: numbers that draw a direction, as of rp_probe_sky, and one for its texel. results: what shines from there over the density.
__kernel void rp_probe_sky_shares(RP_PROBE_TABLES, const __global uint4* restrict items, uint count, __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    RP_PROBE_MAKE_TEXTURES
    float density;
    const float2 place = rp_sample_sky(sky, items[i].y, rp_unit_1(items[i].x), rp_unit_1(items[i].z), &density);
    const rp_numbers_1 bits = {items[i].w, items[i].w << 16, 0u, 0u};
    float3 color;
    uint absent;
    rp_look_at_sky(&textures, sky, place, sky[RP_IMAGE_LEVEL], &bits, &color, &absent);
    results[i] = (float4)(color / density, 0.0f);
}
