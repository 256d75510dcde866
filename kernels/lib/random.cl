// Counter-based random numbers: a pure function of (pixel, sample, depth, purpose), so that pictures do not depend on the order of work.
#ifndef RP_RANDOM_CL
#define RP_RANDOM_CL

#define RP_RANDOM_CAMERA 0u   // position in the pixel
#define RP_RANDOM_LIGHT 1u    // choice of light, point on it; Russian roulette
#define RP_RANDOM_BSDF 2u     // direction, lobe; shadow ray or continuation

// pcg4d: Jarzynski and Olano 2020, "Hash Functions for GPU Rendering".
static inline uint4 rp_hash4(uint4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Four independent uniform 32-bit numbers.
static inline uint4 rp_random_bits(uint pixel, uint sample, uint depth, uint purpose, uint seed) {
    return rp_hash4((uint4)(pixel, sample, depth << 4 | purpose, seed));
}
// As numbers in [0, 1).
static inline float4 rp_unit(uint4 bits) { return convert_float4(bits >> 8u) * 0x1p-24f; }
static inline float4 rp_random(uint pixel, uint sample, uint depth, uint purpose, uint seed) {
    return rp_unit(rp_random_bits(pixel, sample, depth, purpose, seed));
}

#endif
