// Chooses among many lights by what they could give at a place (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
// Splitting"; Pharr, Jakob, Humphreys 2023, chapter 12.6.3), and says how likely it is to choose a given one. The normal there plays no part: at the
// hit of a ray only the place where it began is known.
#ifndef RP_LIGHT_TREE_CL
#define RP_LIGHT_TREE_CL

#include "raypager/abi/light_tree.h"

// Squared distances count as at least this share of the squared radius: within its sphere, nothing is known about where the lights of a node are.
#define RP_LIGHT_NEAREST 0.25f

// At least 0; exactly 0 only where none of the lights of a node gives anything.
static inline float rp_light_importance(const __global uint* node, float3 place) {
    const uint4 sphere = vload4(0, node), lights = vload4(1, node);
    const float x = place.x - as_float(sphere.x), y = place.y - as_float(sphere.y), z = place.z - as_float(sphere.z), radius = as_float(sphere.w);
    const float squared = x * x + y * y + z * z, squared_radius = radius * radius, nearest = rp_max(RP_LIGHT_NEAREST * squared_radius, 1e-30f);
    const float inverse = 1.0f / sqrt(rp_max(squared, nearest)), most = as_float(lights.x) * inverse * inverse;
    if (squared <= squared_radius) return most;
    const int axis = (int)lights.y;
    const float along = (float)(axis << 22 >> 22) * x + (float)(axis << 12 >> 22) * y + (float)(axis << 2 >> 22) * z;
    const float cosine = along * (inverse * (1.0f / 511.0f));
    // The spread of axes, and that of directions from a point of the sphere to the place, at most: their sum.
    const float spread = (float)((int)lights.z << 16 >> 16) * (1.0f / 32767.0f), spread_sine = (float)(lights.z >> 16) * (1.0f / 65535.0f);
    const float within_sine = rp_min(1.0f, radius * inverse), within = sqrt(1.0f - within_sine * within_sine);
    const float both = spread * within - spread_sine * within_sine, both_sine = spread_sine * within + spread * within_sine;
    if (cosine >= both || (both_sine <= 0.0f && spread < 0.0f)) return most;
    const float turned = cosine * both + sqrt(rp_max(0.0f, 1.0f - cosine * cosine)) * both_sine;
    return most * rp_max(0.0f, turned);
}

// How many of `width` numbers choose the first of two nodes. Both sides are left some, unless they give nothing.
static inline ulong rp_light_split(ulong width, float first, float second) {
    const float sum = first + second;
    if (!(sum > 0.0f && sum < INFINITY)) return width >> 1;
    if (second == 0.0f) return width;
    const float share = first / sum;
    const uint fixed = share < 1.0f ? max((uint)(share * 0x1p32f), first > 0.0f ? 1u : 0u) : 0xffffffffu;
    return mul_hi(width, (ulong)fixed << 32);
}

// How many numbers of 64 bits choose the tree (all but one of them, where nothing else can be chosen).
static inline ulong rp_light_tree_width(const __global uint* tree) {
    const uint last = tree[tree[RP_LIGHT_TREE_STEPS]];
    return last == 0xffffffffu ? ~0ul : ((ulong)last + 1ul) << 32;
}

// rp_choose_light at a place. more: further digits of the number. chance: of the light that is chosen.
static inline uint rp_choose_light_at(const __global uint* tree, const __global rp_light* lights, float3 place, uint random, uint more, float* rest,
                                      float* chance) {
    const float fine = (float)(more >> 8) * 0x1p-24f;
    const uint other = rp_choose_light(tree + tree[RP_LIGHT_TREE_STEPS], tree[RP_LIGHT_TREE_COUNT], random, fine, rest);
    if (other != 0u) {
        const uint light = tree[tree[RP_LIGHT_TREE_OTHERS] + other - 1u];
        *chance = lights[light].probability;
        return light;
    }
    // Steps down as arithmetic coding takes them: the light's share of all numbers is its probability, to the last one.
    ulong number = (ulong)random << 32 | more, width = rp_light_tree_width(tree);
    uint next = 0u;
    while (!(next & RP_LIGHT_LEAF)) {
        const __global uint* pair = tree + RP_LIGHT_TREE_PAIRS + 16u * next;
        const ulong split = rp_light_split(width, rp_light_importance(pair, place), rp_light_importance(pair + 8u, place));
        const bool second = number >= split;
        number -= second ? split : 0ul;
        width = second ? width - split : split;
        next = pair[second ? 15u : 7u];
    }
    *rest = rp_min((float)number / (float)width, 0x1.fffffep-1f);
    *chance = (float)width * 0x1p-64f;
    return next & ~RP_LIGHT_LEAF;
}

// With which probability that chooses this light, which has a place.
static inline float rp_light_chance(const __global uint* tree, float3 place, uint light) {
    const uint2 words = vload2(light, tree + tree[RP_LIGHT_TREE_WAYS]);
    ulong way = (ulong)words.y << 32 | words.x, width = rp_light_tree_width(tree);
    uint next = 0u;
    for (; way > 1ul; way >>= 1) {
        const __global uint* pair = tree + RP_LIGHT_TREE_PAIRS + 16u * next;
        const ulong split = rp_light_split(width, rp_light_importance(pair, place), rp_light_importance(pair + 8u, place));
        const bool second = (way & 1ul) != 0ul;
        width = second ? width - split : split;
        next = pair[second ? 15u : 7u];
    }
    return (float)width * 0x1p-64f;
}

#endif
