// For tests: textures outside a path. Built with RP_TEXTURES, RP_SHORT_STATES, RP_NOISE, RP_BUMPS, RP_ANISOTROPIC and one slab.
#include "shading/texture.cl"

#define RP_PROBE_TABLES                                                                                             \
    const __global uint4 *restrict pages, const __global uchar *restrict slab, const __global uint *restrict words, \
        __constant rp_texture_tables *restrict at
#define RP_PROBE_MAKE_TEXTURES \
    rp_geometry geometry;      \
    geometry.pages = pages;    \
    geometry.slab0 = slab;     \
    const rp_textures textures = {&geometry, words, at, 0, 0, 0u, 0u};

static inline uint2 rp_probe_texel(const rp_textures* t, const __global rp_image* image, rp_texel_address address) {
    if (address.page == RP_NONE) return (uint2)(0u);
    const uint where = t->geometry->pages[t->at->first_page + address.page].x;
    return rp_read_texel(rp_block_address(t->geometry, where) + address.at, RP_TEXEL_LOG_BYTES(image->format));
}

// items: image, operation, s, t; width, three random numbers. results: page, byte, the texel's words; its channels.
__kernel void rp_probe_texels(RP_PROBE_TABLES, const __global uint4* restrict items, uint count, __global uint4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    RP_PROBE_MAKE_TEXTURES
    const uint4 a = items[2u * i], b = items[2u * i + 1u];
    const __global rp_image* image = (const __global rp_image*)(words + at->images) + a.x;
    const rp_texture_point place = {(float3)(as_float(a.z), as_float(a.w), 0.0f), as_float(b.x)};
    const rp_numbers_1 bits = {b.y, b.z, b.w, 0u};
    const rp_texel_address address = rp_find_texel(&textures, image, a.y, &place, &bits);
    const uint2 texel = rp_probe_texel(&textures, image, address);
    results[2u * i] = (uint4)(address.page, address.at, texel);
    results[2u * i + 1u] = as_uint4(rp_texel_channels(&textures, image, texel));
}

// items: image, operation, s, t; width, samples. results: the mean of the channels, by the random numbers of pixel i.
__kernel void rp_probe_means(RP_PROBE_TABLES, const __global uint4* restrict items, uint count, __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    RP_PROBE_MAKE_TEXTURES
    const uint4 a = items[2u * i], b = items[2u * i + 1u];
    const __global rp_image* image = (const __global rp_image*)(words + at->images) + a.x;
    const rp_texture_point place = {(float3)(as_float(a.z), as_float(a.w), 0.0f), as_float(b.x)};
    float4 sum = (float4)(0.0f);
    for (uint sample = 0u; sample < b.y; sample++) {
        const rp_numbers_1 bits = rp_random_bits_1(i, sample, 1u, RP_RANDOM_TEXTURE, 0u);
        const rp_texel_address address = rp_find_texel(&textures, image, a.y, &place, &bits);
        sum += rp_texel_channels(&textures, image, rp_probe_texel(&textures, image, address));
    }
    results[i] = sum / (float)b.y;
}

// items: position, map; u, v, density, width. results: coordinates, width there.
__kernel void rp_probe_maps(RP_PROBE_TABLES, const __global float4* restrict items, uint count, __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    RP_PROBE_MAKE_TEXTURES
    const float4 a = items[2u * i], b = items[2u * i + 1u];
    rp_texture_site site;
    site.position = a.xyz;
    site.uv = b.xy;
    site.density = b.z;
    site.width = b.w;
    const rp_texture_point place = rp_place_of(&textures, as_uint(a.w), &site);
    results[i] = (float4)(place.at, place.width);
}

// results: the angle of an item as a share of a turn, the logarithm of its first number.
__kernel void rp_probe_numbers(RP_PROBE_TABLES, const __global float2* restrict items, uint count, __global float2* restrict results) {
    const uint i = get_global_id(0);
    if (i < count) results[i] = (float2)(rp_turns_of(items[i].x, items[i].y), rp_log2_near(items[i].x));
}

// items: point, width; an operation's kind, or RP_NONE for noise itself, octaves, omega, variation.
__kernel void rp_probe_noise(RP_PROBE_TABLES, const __global float4* restrict items, uint count, __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const float3 p = items[2u * i].xyz;
    const float width = items[2u * i].w;
    const float4 b = items[2u * i + 1u];
    const uint kind = as_uint(b.x);
    if (kind == RP_NONE) results[i] = (float4)(rp_noise(p));
    if (kind == RP_TEXTURE_FBM || kind == RP_TEXTURE_WRINKLED) results[i] = (float4)(rp_octaves(p, width, b.z, b.y, kind == RP_TEXTURE_WRINKLED));
    if (kind == RP_TEXTURE_WINDY) results[i] = (float4)(rp_windy(p, width));
    if (kind == RP_TEXTURE_MARBLE) results[i] = (float4)(rp_marble(p, width, b.z, b.y, b.w), 0.0f);
    if (kind == RP_TEXTURE_DOTS) results[i] = (float4)(rp_in_dot(p.xy) ? 1.0f : 0.0f);
}

// sites: position, u; normal, v; tangent, density; bitangent, width; shading, flips; pixel, sample, depth, shading normal; material, have. texels:
// the words of each slot, before and after. own: the materials, after; results: whether the program has run to its end, the absent page, have,
// shading normal.
__kernel void rp_probe_programs(RP_PROBE_TABLES, const __global float4* restrict sites, uint count, __global uint4* restrict results,
                                const __global rp_material* restrict materials, __global uint* restrict status, __global uint* restrict texels,
                                __global rp_material* restrict own) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    RP_PROBE_MAKE_TEXTURES
    const __global float4* s = sites + 7u * i;
    const uint4 of_path = as_uint4(s[5]), which = as_uint4(s[6]);
    rp_texture_site site;
    site.position = s[0].xyz;
    site.normal = s[1].xyz;
    site.uv = (float2)(s[0].w, s[1].w);
    site.tangent = s[2].xyz;
    site.density = s[2].w;
    site.bitangent = s[3].xyz;
    site.width = s[3].w;
    site.shading = s[4].xyz;
    site.flips = as_uint(s[4].w);
    site.pixel = of_path.x;
    site.sample = of_path.y;
    site.depth = of_path.z;
    site.seed = 0u;
    site.shading_normal = of_path.w;
    const rp_paths paths = {count, status, 0};
    for (uint k = 0u; k < RP_TEXEL_WORDS; k++) rp_set_texel_word(&paths, i, k, texels[RP_TEXEL_WORDS * i + k]);
    rp_material m = materials[which.x];
    uint have = which.y, absent = RP_NONE;
    const bool done = rp_run_program(&textures, &site, &paths, i, &have, &absent, &m);
    for (uint k = 0u; k < RP_TEXEL_WORDS; k++) texels[RP_TEXEL_WORDS * i + k] = rp_texel_word(&paths, i, k);
    own[i] = m;
    results[i] = (uint4)(done ? 1u : 0u, absent, have, site.shading_normal);
}
