// Noise for textures: Perlin's of 2002 ("Improving Noise"), and what is made of it as in pbrt-v3 and v4 (Pharr, Jakob, Humphreys 2023, chapter 10.6
// and the textures of the third edition), so that scenes look as they do there.
#ifndef RP_NOISE_CL
#define RP_NOISE_CL

#include "common/arithmetic.cl"

// Perlin's permutation.
__constant uchar rp_permutation[256] = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,  69,  142, 8,   99,  37,  240, 21,  10,  23,
    190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,  94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,
    125, 136, 171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122, 60,  211, 133, 230, 220, 105, 92,
    41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161, 1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130,
    116, 188, 159, 86,  164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126, 255, 82,  85,  212, 207,
    206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213, 119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,
    172, 9,   129, 22,  39,  253, 19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193, 238, 210, 144,
    12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,  181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,
    127, 4,   150, 254, 138, 236, 205, 93,  222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

static inline float rp_noise_corner(int x, int y, int z, float3 d) {
    const uint a = rp_permutation[x & 255], b = rp_permutation[(a + (uint)y) & 255u], h = rp_permutation[(b + (uint)z) & 255u] & 15u;
    const float u = h < 8u || h == 12u || h == 13u ? d.x : d.y, v = h < 4u || h == 12u || h == 13u ? d.y : d.z;
    return (h & 1u ? -u : u) + (h & 2u ? -v : v);
}

static float rp_noise(float3 p) {
    // Beyond this, floats have no fractions.
    p = clamp(p, -0x1p23f, 0x1p23f);
    const float3 whole = floor(p), d = p - whole;
    const int x = (int)whole.x, y = (int)whole.y, z = (int)whole.z;
    const float3 w = d * d * d * (d * (d * 6.0f - 15.0f) + 10.0f);
    float edge[4];
    for (int i = 0; i < 4; i++) {
        const int j = i & 1, k = i >> 1;
        const float3 from = d - (float3)(0.0f, (float)j, (float)k);
        const float low = rp_noise_corner(x, y + j, z + k, from), high = rp_noise_corner(x + 1, y + j, z + k, from - (float3)(1.0f, 0.0f, 0.0f));
        edge[i] = low + w.x * (high - low);
    }
    const float front = edge[0] + w.y * (edge[1] - edge[0]), back = edge[2] + w.y * (edge[3] - edge[2]);
    return front + w.z * (back - front);
}

static inline float rp_smoothstep(float low, float high, float x) {
    const float t = clamp((x - low) / (high - low), 0.0f, 1.0f);
    return t * t * (3.0f - 2.0f * t);
}

// Octaves of noise, each 1.99 times as fine and omega times as strong as the one before, as far as they are not finer than the footprint, whose
// width is in the same space as p. folded: of magnitudes, with the mean of those that are left out.
static float rp_octaves(float3 p, float width, float omega, float octaves, bool folded) {
    const float n = clamp(-1.0f - (width > 0.0f ? log2(width) : -64.0f), 0.0f, octaves), whole = floor(n);
    float sum = 0.0f, lambda = 1.0f, strength = 1.0f;
    for (float i = 0.0f; i < whole; i += 1.0f) {
        const float v = rp_noise(lambda * p);
        sum += strength * (folded ? fabs(v) : v);
        lambda *= 1.99f;
        strength *= omega;
    }
    const float part = rp_smoothstep(0.3f, 0.7f, n - whole), v = rp_noise(lambda * p);
    if (!folded) return sum + strength * part * v;
    sum += strength * (0.2f + part * (fabs(v) - 0.2f));
    for (float i = whole; i < octaves; i += 1.0f) {
        sum += strength * 0.2f;
        strength *= omega;
    }
    return sum;
}

static inline float rp_windy(float3 p, float width) {
    return fabs(rp_octaves(0.1f * p, 0.1f * width, 0.5f, 3.0f, false)) * rp_octaves(p, width, 0.5f, 6.0f, false);
}

// A spline of colours along waves that noise disturbs. p is scaled already.
static float3 rp_marble(float3 p, float width, float omega, float octaves, float variation) {
    const float veins = p.y + variation * rp_octaves(p, width, omega, octaves, false);
    const float t = 0.5f + 0.5f * sin(veins), at = t * 6.0f, first = fmin(floor(at), 5.0f), f = at - first;
    float3 c[4];
    for (int i = 0; i < 4; i++) {
        const int k = (int)first + i;
        c[i] = k == 3 ? (float3)(0.5f) : k == 4 ? (float3)(0.6f, 0.59f, 0.58f) : k == 7 ? (float3)(0.2f, 0.2f, 0.33f) : (float3)(0.58f, 0.58f, 0.6f);
    }
    for (int n = 3; n > 0; n--)
        for (int i = 0; i < n; i++) c[i] = (1.0f - f) * c[i] + f * c[i + 1];
    return 1.5f * c[0];
}

// Disks of radius 0.35 around places in the cells of which noise makes so.
static inline bool rp_in_dot(float2 at) {
    const float2 cell = floor(at + 0.5f);
    if (rp_noise((float3)(cell + 0.5f, 0.5f)) <= 0.0f) return false;
    const float2 shift = (float2)(rp_noise((float3)(cell + (float2)(1.5f, 2.8f), 0.5f)), rp_noise((float3)(cell + (float2)(4.5f, 9.8f), 0.5f)));
    const float2 from = at - (cell + 0.15f * shift);
    return dot(from, from) < 0.35f * 0.35f;
}

#endif
