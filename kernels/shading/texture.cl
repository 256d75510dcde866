// Textures at a hit (abi/texture.h): runs the program of a material, and looks up the texels that it asks for.
//
// A lookup reads one texel of one level of an image: both are chosen by random numbers, so that their mean is what a filter over the ray's footprint
// gives (Fajardo et al. 2023, "Stochastic Texture Filtering"). So a path waits for one page at a time, and what it finds depends on the path alone.
// The texels that a path has found stay in words of its slot while it waits for more.
#ifndef RP_TEXTURE_CL
#define RP_TEXTURE_CL

#include "common/angles.cl"
#include "common/geometry.cl"
#include "common/normal.cl"
#include "common/path_state.cl"
#include "common/random.cl"
#include "raypager/abi/scene.h"
#include "raypager/abi/texture.h"
#ifndef RP_SHORT_STATES
#include "common/waiting_lists.cl"
#endif
#ifdef RP_NOISE
#include "shading/noise.cl"
#endif

// What is looked up in, and where: all of a kernel.
typedef struct rp_textures {
    const rp_geometry* geometry;
    const __global uint* words;        // tables (src/texture/texture_words.hpp); the first 256 are sRGB, as floats
    __constant rp_texture_tables* at;  // where the tables begin
    volatile __global uint* demand;
    volatile __global uint* counters;
    uint block_count, round;  // pages: of geometry and of images; 0: what is looked up is not noted
#ifdef RP_SKY_PAGED
    const __global rp_light* lights;
    const __global uint* light_steps;
#endif
} rp_textures;

// A hit, as textures see it.
typedef struct rp_texture_site {
    float3 position, normal;  // normal: geometric, unit
    float2 uv;
    float density;                    // of uv: their change per unit length
    float width;                      // of what one path stands for, on the surface
    uint pixel, sample, depth, seed;  // what random numbers are a function of
    uint flips;                       // changes them
#ifdef RP_BUMPS
    float3 shading, tangent, bitangent;  // unit, at right angles
    uint shading_normal;                 // octahedral; programs change it
#endif
} rp_texture_site;

// The path of a slot waits for a page. waiting_status: as of rp_wait_to_shade.
static inline void rp_await_page(const rp_textures* t, const rp_paths* paths, uint slot, uint waiting_status, uint page) {
#ifdef RP_SHORT_STATES
    rp_wait_for_block(paths, slot, page, waiting_status, t->demand, t->block_count);
#else
    rp_set_status(paths, slot, waiting_status);
    rp_set_wait_word(paths, slot, atomic_xchg(rp_lists_of(t->demand, t->block_count, page) + slot / 64u % RP_LISTS, slot + 1u));
    rp_request(t->demand, t->block_count, page, 1u);
    atomic_inc(t->counters + RP_COUNT_IN_LISTS);
#endif
}

// ---- Coordinates

typedef struct rp_texture_point {
    float3 at;
    float width;  // of the footprint, in the same space
} rp_texture_point;

static inline float rp_row_times(const __global float* row, float3 p) {
    return rp_add(rp_add(rp_mul(row[0], p.x), rp_mul(row[1], p.y)), rp_add(rp_mul(row[2], p.z), row[3]));
}
static inline float rp_row_length(const __global float* row) { return sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]); }

static inline rp_texture_point rp_place_of(const rp_textures* t, uint number, const rp_texture_site* site) {
    rp_texture_point place;
    place.at = (float3)(site->uv.x, site->uv.y, 0.0f);
    place.width = site->width * site->density;
    if (number == RP_NONE) return place;
    const __global rp_texture_map* map = (const __global rp_texture_map*)(t->words + t->at->maps) + number;
    const __global float* m = map->m;
    if (map->kind == RP_MAP_UV) {
        place.at.x = rp_add(rp_add(rp_mul(m[0], site->uv.x), rp_mul(m[1], site->uv.y)), m[2]);
        place.at.y = rp_add(rp_add(rp_mul(m[4], site->uv.x), rp_mul(m[5], site->uv.y)), m[6]);
        place.width *= sqrt(fabs(m[0] * m[5] - m[1] * m[4]));
        return place;
    }
    const float3 p = (float3)(rp_row_times(m, site->position), rp_row_times(m + 4, site->position), rp_row_times(m + 8, site->position));
    place.at = p;
    place.width = site->width * rp_max(rp_max(rp_row_length(m), rp_row_length(m + 4)), map->kind == RP_MAP_POINT ? rp_row_length(m + 8) : 0.0f);
    if (map->kind == RP_MAP_POINT) return place;
    const float across = sqrt(p.x * p.x + p.y * p.y), far = rp_max(across, fabs(p.z)), turns = rp_turns_of(p.x, p.y);
    const float2 on =
        map->kind == RP_MAP_SPHERE ? (float2)(2.0f * rp_turns_of(p.z, across), turns) : (float2)(turns < 0.5f ? turns + 0.5f : turns - 0.5f, p.z);
    const float2 st = map->swapped != 0u ? on.yx : on;
    place.at = (float3)(rp_add(rp_mul(st.x, map->scale[0]), map->offset[0]), rp_add(rp_mul(st.y, map->scale[1]), map->offset[1]), 0.0f);
    // The geometric mean of both axes. A turn is 2 pi times as long as the distance from the axis, half a turn on a sphere pi times as long as that
    // from its middle; along a cylinder lengths stay as they are.
    const float by = map->kind == RP_MAP_SPHERE ? 4.4428829f * far : sqrt(6.2831853f * across);
    place.width = by > 0.0f ? place.width * sqrt(fabs(map->scale[0] * map->scale[1])) / by : 0.0f;
    return place;
}

// ---- Images

// The binary logarithm of a positive number, to 0.009: that of whatever device, to the bit.
static inline float rp_log2_near(float x) {
    const int bits = as_int(x);
    const float mantissa = as_float((bits & 0x007fffff) | 0x3f800000);
    return (float)((bits >> 23) - 127) + rp_mul(mantissa - 1.0f, rp_add(1.35f, rp_mul(-0.35f, mantissa - 1.0f)));
}

// Texel i of n along an axis, by how the image goes on beyond its edges; -1: there is none.
static inline int rp_wrapped(int i, int n, uint wrap) {
    if (i >= 0 && i < n) return i;
    if (wrap == RP_WRAP_BLACK) return -1;
    if (wrap == RP_WRAP_CLAMP) return clamp(i, 0, n - 1);
    // Not beyond one more image: coordinates are less their whole parts.
    return wrap == RP_WRAP_MIRROR ? clamp(i < 0 ? -1 - i : 2 * n - 1 - i, 0, n - 1) : clamp(i < 0 ? i + n : i - n, 0, n - 1);
}

// A coordinate on n texels, moved by the random number u in [0, 1) so that the mean is linear between the middles of texels.
static inline int rp_texel_along(float s, int n, float u, uint wrap) {
    if (wrap == RP_WRAP_REPEAT) {
        s = s - floor(s);
    } else if (wrap == RP_WRAP_MIRROR) {
        s = s - 2.0f * floor(0.5f * s);
        s = s > 1.0f ? 2.0f - s : s;
    }
    // Far outside is as good as just outside.
    s = rp_min(rp_max(s, -1.0f), 2.0f);
    return rp_wrapped((int)floor(rp_add(rp_mul(s, (float)n), u - 0.5f)), n, wrap);
}

static inline uint rp_spread_bits(uint x) {
    x = (x | x << 4) & 0x0f0fu;
    x = (x | x << 2) & 0x3333u;
    return (x | x << 1) & 0x5555u;
}

// Which texel of a tile, in Morton order: tiles are as high as wide, or half as high.
static inline uint rp_in_tile(uint x, uint y, uint log_height) {
    const uint low = (1u << log_height) - 1u;
    return rp_spread_bits(x & low) | rp_spread_bits(y) << 1 | (x & ~low) << log_height;
}

typedef struct rp_texel_address {
    uint page, at;  // of the images; byte in it. page: RP_NONE, the texel is black
} rp_texel_address;

// Of a level (rp_image_level).
static inline rp_texel_address rp_texel_of_level(uint4 level, uint log_bytes, uint x, uint y) {
    rp_texel_address address = {level.x, 0u};
    if (level.w != RP_NONE) {
        address.at = level.w + ((y * level.y + x) << log_bytes);
        return address;
    }
    const uint log_width = RP_TILE_LOG_WIDTH(log_bytes), log_height = RP_TILE_LOG_HEIGHT(log_bytes);
    const uint tiles_along = (level.y + (1u << log_width) - 1u) >> log_width;
    address.page += (y >> log_height) * tiles_along + (x >> log_width);
    address.at = rp_in_tile(x & ((1u << log_width) - 1u), y & ((1u << log_height) - 1u), log_height) << log_bytes;
    return address;
}

static inline rp_texel_address rp_find_texel(const rp_textures* t, const __global rp_image* image, uint op, const rp_texture_point* place,
                                             const rp_numbers_1* bits) {
    const __global uint4* levels = (const __global uint4*)(t->words + t->at->image_levels) + image->first_level;
    const uint wrap = op >> RP_TEXTURE_WRAP_SHIFT & 3u, wrap_across = op >> (RP_TEXTURE_WRAP_SHIFT + 2) & 3u;
    const uint4 whole = levels[0];
    const float texels = rp_mul(place->width, (float)max(whole.y, whole.z));
    const float level = rp_add(texels > 0x1p-20f ? rp_log2_near(texels) : -20.0f, rp_unit_1(bits->z));
    const uint chosen = (uint)clamp((int)floor(rp_min(level, 64.0f)), 0, (int)image->levels - 1);
    const uint4 record = chosen == 0u ? whole : levels[chosen];  // rp_image_level
    const int x = rp_texel_along(place->at.x, (int)record.y, rp_unit_1(bits->x), wrap);
    const int y = rp_texel_along(place->at.y, (int)record.z, rp_unit_1(bits->y), wrap_across);
    const rp_texel_address none = {RP_NONE, 0u};
    return x < 0 || y < 0 ? none : rp_texel_of_level(record, RP_TEXEL_LOG_BYTES(image->format), (uint)x, (uint)y);
}

// The words of a texel in memory, the lower ones first.
static inline uint2 rp_read_texel(const __global uchar* at, uint log_bytes) {
    if (log_bytes == 0u) return (uint2)(*at, 0u);
    if (log_bytes == 1u) return (uint2)(*(const __global ushort*)at, 0u);
    if (log_bytes == 2u) return (uint2)(*(const __global uint*)at, 0u);
    return *(const __global uint2*)at;
}

static inline float rp_half_number(uint bits) {
    const float magnitude = as_float((bits & 0x7fffu) << 13) * 0x1p112f;
    return bits & 0x8000u ? -magnitude : magnitude;
}
// What is opaque is exactly 1.
static inline float rp_channel_number(const rp_textures* t, uint bits, uint format, bool srgb) {
    if (format == RP_TEXEL_GRAY_HALF || format == RP_TEXEL_RGBA_HALF) return rp_half_number(bits);
    if (format == RP_TEXEL_GRAY16 || format == RP_TEXEL_RGBA16) return rp_div((float)bits, 65535.0f);
    return srgb ? as_float(t->words[bits]) : rp_div((float)bits, 255.0f);
}
static inline float4 rp_texel_channels(const rp_textures* t, const __global rp_image* image, uint2 texel) {
    const uint format = image->format;
    const bool srgb = image->srgb != 0u;
    if (format <= RP_TEXEL_GRAY_HALF) {
        const float v = rp_channel_number(t, texel.x, format, srgb);
        return (float4)(v, v, v, 1.0f);
    }
    const bool bytes = format == RP_TEXEL_RGBA8;
    const uint red = bytes ? texel.x & 255u : texel.x & 0xffffu, green = bytes ? texel.x >> 8 & 255u : texel.x >> 16;
    const uint blue = bytes ? texel.x >> 16 & 255u : texel.y & 0xffffu, alpha = bytes ? texel.x >> 24 : texel.y >> 16;
    return (float4)(rp_channel_number(t, red, format, srgb), rp_channel_number(t, green, format, srgb), rp_channel_number(t, blue, format, srgb),
                    rp_channel_number(t, alpha, format, false));
}

static inline float3 rp_of_channels(float4 c, uint op) {
    const uint which = op >> RP_TEXTURE_CHANNEL_SHIFT & RP_TEXTURE_CHANNEL_MASK;
    if (which == 0u) return c.xyz;
    const float v = which == 1u   ? (c.x + c.y + c.z) * (1.0f / 3.0f)
                    : which == 2u ? 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z
                    : which == 3u ? c.x
                    : which == 4u ? c.y
                    : which == 5u ? c.z
                                  : c.w;
    return (float3)(v);
}

// A lookup counts as a ray that enters a block, and as one that ends there: what of policies is about use is about both. bits: random, which say
// whether it is one of those that are counted (rp_note_entry).
static inline void rp_note_texture_page(const rp_textures* t, uint page, uint bits) {
#ifdef RP_TRACK_BOUNCES
    rp_note_bounce(t->demand, t->block_count, page);
#endif
#if defined(RP_TRACK_ENTERS) || defined(RP_TRACK_LAST_ROUND)
    volatile __global uint* const used = t->demand + RP_DEMAND_USED * (size_t)t->block_count + page;
#endif
#if defined(RP_TRACK_ENTERS)
    if (t->round == 0u) return;
    if ((bits >> 16 & RP_TRACK_ENTERS) != 0u) return;
    rp_add_without_result(used, 1u);
    rp_mark(t->geometry->marks, page);
#elif defined(RP_TRACK_LAST_ROUND)
    if (*used == t->round) return;
    *used = t->round;
    rp_mark(t->geometry->marks, page);
#endif
}

// Random numbers of lookups: xy within the texel, z level. Those that are not to lie alike have numbers that do not depend on each other, so that
// products of textures have the mean that products of their means have. Numbers of which some bits are flipped would not do: where the ones are
// small, the others would be large.
static inline rp_numbers_1 rp_lookup_bits(const rp_texture_site* site, uint jitter) {
    const rp_numbers_1 n = rp_random_bits_1(site->pixel, site->sample, site->depth | jitter << 20, RP_RANDOM_TEXTURE, site->seed);
    const uint h = site->flips * 0x9e3779b9u;
    const rp_numbers_1 bits = {n.x ^ h, n.y ^ (h ^ h >> 15) * 0x85ebca6bu, n.z ^ (h ^ h >> 13) * 0xc2b2ae35u, 0u};
    return bits;
}

// An image operation. have: a bit for each word at which the slot has a texel. False: the page *absent (in the page table) is not there.
static inline bool rp_look_up(const rp_textures* t, const __global rp_texture_op* op, const rp_texture_site* site, const rp_paths* paths, uint slot,
                              uint* have, float3* value, uint* absent) {
    const __global rp_image* image = (const __global rp_image*)(t->words + t->at->images) + op->image;
    const uint log_bytes = RP_TEXEL_LOG_BYTES(image->format), lookup = op->lookup;
    uint2 texel = (uint2)(0u);
    if (*have >> lookup & 1u) {
        texel.x = rp_texel_word(paths, slot, lookup);
        if (log_bytes == 3u) texel.y = rp_texel_word(paths, slot, lookup + 1u);
    } else {
        const rp_texture_point place = rp_place_of(t, op->map, site);
        const rp_numbers_1 bits = rp_lookup_bits(site, op->op >> RP_TEXTURE_JITTER_SHIFT & RP_TEXTURE_JITTER_MASK);
        const rp_texel_address address = rp_find_texel(t, image, op->op, &place, &bits);
        if (address.page != RP_NONE) {
            const uint page = t->at->first_page + address.page, where = t->geometry->pages[page].x;
            if (where == RP_NONE) {
                *absent = page;
                return false;
            }
            rp_note_texture_page(t, page, bits.x);
            texel = rp_read_texel(rp_block_address(t->geometry, where) + address.at, log_bytes);
        }
        rp_set_texel_word(paths, slot, lookup, texel.x);
        if (log_bytes == 3u) rp_set_texel_word(paths, slot, lookup + 1u, texel.y);
        *have |= 1u << lookup;
    }
    const float3 v = rp_of_channels(rp_texel_channels(t, image, texel), op->op) * rp_load3(op->a);
    *value = op->op & RP_TEXTURE_INVERT ? fmax(1.0f - v, 0.0f) : v;
    return true;
}

// ---- Programs

// GGX alpha of roughness: as it is; its square root (pbrt-v4); the polynomial of pbrt-v3.
static inline float rp_alpha_of(float roughness, float remap) {
    if (remap == 0.0f) return roughness;
    if (remap == 1.0f) return sqrt(fmax(roughness, 0.0f));
    const float x = log(fmax(roughness, 1e-3f));
    return 1.62142f + x * (0.819955f + x * (0.1734f + x * (0.0171201f + x * 0.000640711f)));
}

static inline void rp_store_rgb(float3 v, float* out) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

static inline void rp_set_parameter(rp_material* m, uint parameter, float3 v, float remap) {
    const float3 share = clamp(v, 0.0f, 1.0f);
    if (parameter == RP_PARAMETER_COLOR) {
        rp_store_rgb(share, m->color);
    } else if (parameter == RP_PARAMETER_SPECULAR) {
        rp_store_rgb(share, m->specular);
    } else if (parameter == RP_PARAMETER_TRANSMITTANCE) {
        rp_store_rgb(share, m->transmittance);
    } else if (parameter == RP_PARAMETER_MIRROR) {
        rp_store_rgb(share, m->mirror);
    } else if (parameter == RP_PARAMETER_REFRACTED) {
        rp_store_rgb(share, m->refracted);
    } else if (parameter == RP_PARAMETER_ALPHA) {
        // A material that scatters light in one direction does so everywhere.
        m->alpha = clamp(rp_alpha_of(v.x, remap), 1e-3f, 1.0f);
    } else if (parameter == RP_PARAMETER_BASE_ALPHA) {
        m->base_alpha = clamp(rp_alpha_of(v.x, remap), 1e-3f, 1.0f);
#ifdef RP_ANISOTROPIC
    } else if (parameter == RP_PARAMETER_ALPHA_ACROSS) {
        RP_ALPHA_ACROSS(*m) = clamp(rp_alpha_of(v.x, remap), 1e-3f, 1.0f);
    } else if (parameter == RP_PARAMETER_BASE_ALPHA_ACROSS) {
        RP_BASE_ALPHA_ACROSS(*m) = clamp(rp_alpha_of(v.x, remap), 1e-3f, 1.0f);
#endif
    } else if (parameter == RP_PARAMETER_AMOUNT) {
        m->amount = share.x;
    } else if (parameter == RP_PARAMETER_METAL) {
        const float3 r = fmin(share, 0.9999f);
        rp_store_rgb((float3)(1.0f), m->eta);
        rp_store_rgb(2.0f * sqrt(r / (1.0f - r)), m->k);
    }
}

// What an operation but an image's puts on the stack, from the colours beneath: x lies deepest.
static inline float3 rp_operation(const rp_textures* t, const __global rp_texture_op* op, const rp_texture_site* site, float3 x, float3 y, float3 z,
                                  float3 w) {
    const uint kind = op->op & RP_TEXTURE_OPERATION_MASK;
    if (kind == RP_TEXTURE_CONSTANT) return rp_load3(op->a);
    if (kind == RP_TEXTURE_SCALE) return x * y * rp_load3(op->a);
    if (kind == RP_TEXTURE_MIX) return x + z * (y - x);
    if (kind == RP_TEXTURE_DIRECTION) {
        const float share = fabs(dot(site->normal, rp_load3(op->a)));
        return y + share * (x - y);
    }
    const rp_texture_point place = rp_place_of(t, op->map, site);
    const float2 st = place.at.xy;
    if (kind == RP_TEXTURE_CHECKS) {
        const float sum = floor(st.x) + floor(st.y) + (op->op & RP_TEXTURE_SOLID ? floor(place.at.z) : 0.0f);
        return sum - 2.0f * floor(0.5f * sum) == 0.0f ? x : y;
    }
    if (kind == RP_TEXTURE_BILERP) return (1.0f - st.x) * ((1.0f - st.y) * x + st.y * y) + st.x * ((1.0f - st.y) * z + st.y * w);
    if (kind == RP_TEXTURE_UV) return (float3)(st.x - floor(st.x), st.y - floor(st.y), 0.0f);
#ifdef RP_NOISE
    if (kind == RP_TEXTURE_DOTS) return rp_in_dot(st) ? x : y;
    if (kind == RP_TEXTURE_WINDY) return (float3)(rp_windy(place.at, place.width));
    if (kind == RP_TEXTURE_MARBLE) {
        const float scale = op->a[2];
        return rp_marble(scale * place.at, scale * place.width, op->a[1], op->a[0], op->b[0]);
    }
    return (float3)(rp_octaves(place.at, place.width, op->a[1], op->a[0], kind == RP_TEXTURE_WRINKLED));
#else
    return (float3)(0.0f);
#endif
}

#ifdef RP_BUMPS
static inline float rp_bump_step(const rp_texture_site* site, float texels) {
    return site->density > 0.0f && texels > 0.0f ? rp_max(site->width, 1.0f / (site->density * texels)) : site->width;
}

// The surface is looked up elsewhere from here on. steps: along the tangent, across it, texels.
static inline void rp_shift_site(rp_texture_site* site, const __global float* steps) {
    const float step = rp_bump_step(site, steps[2]);
    site->position += step * (steps[0] * site->tangent + steps[1] * site->bitangent);
    site->uv += step * site->density * (float2)(steps[0], steps[1]);
}

static inline void rp_set_normal(rp_texture_site* site, float3 n) {
    if (dot(n, n) > 1e-12f) site->shading_normal = rp_encode_normal(n);
}
static inline void rp_bump(rp_texture_site* site, float h, float hu, float hv, float texels) {
    const float step = rp_bump_step(site, texels);
    if (step > 0.0f) rp_set_normal(site, site->shading - ((hu - h) / step) * site->tangent - ((hv - h) / step) * site->bitangent);
}
#endif

// How many colours an operation takes off the stack.
static inline uint rp_operands(uint kind) {
    return kind == RP_TEXTURE_BILERP                                                                                          ? 4u
           : kind == RP_TEXTURE_MIX || kind == RP_TEXTURE_BUMP                                                                ? 3u
           : kind == RP_TEXTURE_SCALE || kind == RP_TEXTURE_CHECKS || kind == RP_TEXTURE_DOTS || kind == RP_TEXTURE_DIRECTION ? 2u
           : kind == RP_TEXTURE_SET                                                                                           ? 1u
                                                                                                                              : 0u;
}

// Sets the parameters of *m that its program says. have: as of rp_look_up. False: a page is absent.
static inline bool rp_run_program(const rp_textures* t, rp_texture_site* site, const rp_paths* paths, uint slot, uint* have, uint* absent,
                                  rp_material* m) {
    const __global rp_texture_op* op = (const __global rp_texture_op*)(t->words + t->at->ops) + ((m->flags >> RP_MATERIAL_PROGRAM_SHIFT) - 1u);
    float3 stack[RP_TEXTURE_STACK];
    uint size = 0u;
    for (;; op++) {
        const uint word = op->op, kind = word & RP_TEXTURE_OPERATION_MASK;
        size -= rp_operands(kind);
        if (kind == RP_TEXTURE_SET) {
            const float3 v = stack[size];
            rp_set_parameter(m, op->image, word & RP_TEXTURE_INVERT ? 1.0f - v : v, op->a[0]);
#ifdef RP_BUMPS
            if (op->image == RP_PARAMETER_NORMAL)
                rp_set_normal(site,
                              (2.0f * v.x - 1.0f) * site->tangent + (2.0f * v.y - 1.0f) * site->bitangent + (2.0f * v.z - 1.0f) * site->shading);
        } else if (kind == RP_TEXTURE_SHIFT) {
            rp_shift_site(site, op->a);
        } else if (kind == RP_TEXTURE_BUMP) {
            rp_bump(site, stack[size].x, stack[size + 1u].x, stack[size + 2u].x, op->a[2]);
#endif
        } else if (kind == RP_TEXTURE_IMAGE) {
            float3 v;
            if (!rp_look_up(t, op, site, paths, slot, have, &v, absent)) return false;
            stack[size++] = v;
        } else {
            const float3 v = rp_operation(t, op, site, stack[size], stack[min(size + 1u, RP_TEXTURE_STACK - 1u)],
                                          stack[min(size + 2u, RP_TEXTURE_STACK - 1u)], stack[min(size + 3u, RP_TEXTURE_STACK - 1u)]);
            stack[size++] = v;
        }
        if (word & RP_TEXTURE_LAST) return true;
    }
}

#endif
