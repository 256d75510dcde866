// Chooses among many lights by what they could give at a place (Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
// Splitting"; Pharr, Jakob, Humphreys 2023, chapter 12.6.3), and says how likely it is to choose a given one.
//
// With RP_LIGHT_CLOSE the choice looks closer: at the normal, since where light comes in at a slant it gives less, and at the children of near nodes.
// That is for scenes with lamps that have no surface, which no BSDF sample finds: there the choice is all there is against noise. Elsewhere it would
// take a quarter of a render's time for a twentieth of its variance (bench/journal/sampling.md). At the hit of a ray only the place where it began is
// known, not its normal. Weights of multiple importance sampling need not be those of the densities that samples were drawn with, as long as all
// ways to find a light agree about them: they are taken from the choice without a normal, which both sides know, and samples are divided by the
// probability that they were drawn with.
#ifndef RP_LIGHT_TREE_CL
#define RP_LIGHT_TREE_CL

#include "raypager/abi/light_tree.h"

// Down the tree to a leaf. After a loop with a single way out Mesa's compiler (22.3.6, llvmpipe) leaves the next one too soon: in a kernel that first
// chooses a light and then asks for its chance, that is of the first step alone.
#ifdef RP_TWO_WAYS_OUT
#define RP_WHILE_INNER(next)        \
    for (uint i = 0u; i < 64u; i++) \
        if ((next)&RP_LIGHT_LEAF)   \
            break;                  \
        else
#else
#define RP_WHILE_INNER(next) while (!((next)&RP_LIGHT_LEAF))
#endif

// Squared distances count as at least this share of the squared radius: within its sphere, nothing is known about where the lights of a node are.
#define RP_LIGHT_NEAREST 0.25f
#define RP_LIGHT_NEAR 9.0f  // squared distances over squared radii up to which a node's children are looked at
// What of a node's light counts at least where it comes from below the horizon: roundings must not hide what is just above.
#define RP_LIGHT_LEAST_FACING 0.01f

// At least 0; exactly 0 only where none of the lights of a node gives anything.
static inline float rp_light_importance(const __global uint* node, float3 place) {
    const uint4 sphere = vload4(0, node), lights = vload4(1, node);
    const float x = place.x - as_float(sphere.x), y = place.y - as_float(sphere.y), z = place.z - as_float(sphere.z), radius = as_float(sphere.w);
    const float squared = x * x + y * y + z * z, squared_radius = radius * radius, nearest = rp_max(RP_LIGHT_NEAREST * squared_radius, 1e-30f);
    const float inverse = rp_rsqrt(rp_max(squared, nearest)), most = as_float(lights.x) * inverse * inverse;
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

#ifdef RP_LIGHT_CLOSE
// The largest cosine to the normal of directions from the place to a node's sphere, but at least RP_LIGHT_LEAST_FACING.
static inline float rp_light_facing(const __global uint* node, float3 place, float3 normal) {
    const uint4 sphere = vload4(0, node);
    const float x = as_float(sphere.x) - place.x, y = as_float(sphere.y) - place.y, z = as_float(sphere.z) - place.z, radius = as_float(sphere.w);
    const float squared = x * x + y * y + z * z;
    if (squared <= radius * radius) return 1.0f;
    const float inverse = rp_rsqrt(rp_max(squared, 1e-30f)), cosine = (normal.x * x + normal.y * y + normal.z * z) * inverse;
    const float within_sine = rp_min(1.0f, radius * inverse), within = sqrt(1.0f - within_sine * within_sine);
    const float nearest = cosine * within + sqrt(rp_max(0.0f, 1.0f - cosine * cosine)) * within_sine;
    return cosine >= within ? 1.0f : rp_max(RP_LIGHT_LEAST_FACING, nearest);
}

// What a node's lights give, without a normal and with one.
static inline float2 rp_light_own(const __global uint* node, float3 place, float3 normal, bool faces) {
    const float around = rp_light_importance(node, place);
    return (float2)(around, faces && around > 0.0f ? around * rp_light_facing(node, place, normal) : around);
}
// The same, of places near by or inside by what its children give: of the node as a whole too little is known there, and one that is thought too
// bright takes samples from all others.
static inline float2 rp_light_gives(const __global uint* tree, const __global uint* node, float3 place, float3 normal, bool faces) {
    const uint4 sphere = vload4(0, node);
    const float x = as_float(sphere.x) - place.x, y = as_float(sphere.y) - place.y, z = as_float(sphere.z) - place.z, radius = as_float(sphere.w);
    const uint next = node[7];
    if ((next & RP_LIGHT_LEAF) || x * x + y * y + z * z > RP_LIGHT_NEAR * radius * radius) return rp_light_own(node, place, normal, faces);
    const __global uint* pair = tree + RP_LIGHT_TREE_PAIRS + 16u * next;
    return rp_light_own(pair, place, normal, faces) + rp_light_own(pair + 8, place, normal, faces);
}
#endif

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

// rp_choose_light at a place. normal: there, or 0 if light from all around counts. more: further digits of the number. chance: of the light that is
// chosen; weighed: the same without a normal, as rp_light_chance has it.
static inline uint rp_choose_light_at(const __global uint* tree, const __global rp_light* lights, float3 place, float3 normal, uint random, uint more,
                                      float* rest, float* chance, float* weighed) {
    const float fine = (float)(more >> 8) * 0x1p-24f;
    const uint choice = rp_choose_light(tree + tree[RP_LIGHT_TREE_STEPS], tree[RP_LIGHT_TREE_COUNT], random, fine, rest);
    if (choice != 0u) {
        const uint light = tree[tree[RP_LIGHT_TREE_OTHERS] + choice - 1u];
        *chance = *weighed = lights[light].probability;
        return light;
    }
    // Steps down as arithmetic coding takes them: the light's share of all numbers is its probability, to the last one.
    ulong number = (ulong)random << 32 | more, width = rp_light_tree_width(tree);
    uint next = 0u;
#ifdef RP_LIGHT_CLOSE
    ulong all_around = width;
    const bool faces = normal.x != 0.0f || normal.y != 0.0f || normal.z != 0.0f;
#endif
    RP_WHILE_INNER(next) {
        const __global uint* pair = tree + RP_LIGHT_TREE_PAIRS + 16u * next;
#ifdef RP_LIGHT_CLOSE
        const float2 one = rp_light_gives(tree, pair, place, normal, faces), two = rp_light_gives(tree, pair + 8u, place, normal, faces);
        const ulong split_around = rp_light_split(all_around, one.x, two.x), split = rp_light_split(width, one.y, two.y);
        const bool second = number >= split;
        all_around = second ? all_around - split_around : split_around;
#else
        const ulong split = rp_light_split(width, rp_light_importance(pair, place), rp_light_importance(pair + 8u, place));
        const bool second = number >= split;
#endif
        number -= second ? split : 0ul;
        width = second ? width - split : split;
        next = pair[second ? 15u : 7u];
    }
    *rest = rp_min((float)number / (float)width, 0x1.fffffep-1f);
    *chance = *weighed = (float)width * 0x1p-64f;
#ifdef RP_LIGHT_CLOSE
    *weighed = (float)all_around * 0x1p-64f;
#endif
    return next & ~RP_LIGHT_LEAF;
}

// With which probability that chooses this light, which has a place, without a normal.
static inline float rp_light_chance(const __global uint* tree, float3 place, uint light) {
    const uint2 words = vload2(light, tree + tree[RP_LIGHT_TREE_WAYS]);
    ulong way = (ulong)words.y << 32 | words.x, width = rp_light_tree_width(tree);
    uint next = 0u;
    for (; way > 1ul; way >>= 1) {
        const __global uint* pair = tree + RP_LIGHT_TREE_PAIRS + 16u * next;
#ifdef RP_LIGHT_CLOSE
        const float one = rp_light_gives(tree, pair, place, (float3)(0.0f), false).x,
                    two = rp_light_gives(tree, pair + 8u, place, (float3)(0.0f), false).x;
        const ulong split = rp_light_split(width, one, two);
#else
        const ulong split = rp_light_split(width, rp_light_importance(pair, place), rp_light_importance(pair + 8u, place));
#endif
        const bool second = (way & 1ul) != 0ul;
        width = second ? width - split : split;
        next = pair[second ? 15u : 7u];
    }
    return (float)width * 0x1p-64f;
}

#endif
