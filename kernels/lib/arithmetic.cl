// Arithmetic that must come out the same wherever it is inlined: a product that no compiler may fuse with the following sum, minima and
// maxima of finite numbers, and the decoding of grid coordinates.
#ifndef RP_ARITHMETIC_CL
#define RP_ARITHMETIC_CL

#include "raypager/abi/types.h"

#ifdef RP_NV_PTX
// NVIDIA's compiler fuses across FP_CONTRACT OFF in places; an explicitly rounded product stays one.
static inline float rp_mul(float a, float b) {
    float r;
    asm("mul.rn.f32 %0, %1, %2;" : "=f"(r) : "f"(a), "f"(b));
    return r;
}
static inline float rp_add(float a, float b) {
    float r;
    asm("add.rn.f32 %0, %1, %2;" : "=f"(r) : "f"(a), "f"(b));
    return r;
}
// Grid coordinate (abi/block.h) of the near or far plane of an axis, in one byte permutation. The selector of an axis says which half of
// the word is near.
#define RP_NEAR_IS_LOWER 0x7104u
#define RP_NEAR_IS_UPPER 0x7324u
static inline float rp_grid_near(uint word, uint selector) {
    uint r;
    asm("prmt.b32 %0, %1, %2, %3;" : "=r"(r) : "r"(word), "r"(0x47000000u), "r"(selector));
    return as_float(r);
}
static inline float rp_grid_far(uint word, uint selector) { return rp_grid_near(word, selector ^ (RP_NEAR_IS_LOWER ^ RP_NEAR_IS_UPPER)); }
#define rp_min(a, b) fmin(a, b)
#define rp_max(a, b) fmax(a, b)
#else
#pragma OPENCL FP_CONTRACT OFF
static inline float rp_mul(float a, float b) { return a * b; }
static inline float rp_add(float a, float b) { return a + b; }
#define RP_NEAR_IS_LOWER 0u
#define RP_NEAR_IS_UPPER 16u
static inline float rp_grid_near(uint word, uint selector) { return as_float(0x47000000u | (word >> selector & 0xffffu) << 8); }
static inline float rp_grid_far(uint word, uint selector) { return as_float(0x47000000u | (word >> (16u - selector) & 0xffffu) << 8); }
// Comparisons, not fmin: a CPU does them in one instruction.
#define rp_min(a, b) ((a) < (b) ? (a) : (b))
#define rp_max(a, b) ((a) > (b) ? (a) : (b))
#endif

// The sum of three numbers, independent of their order, and with exactly the opposite sign if all signs are reversed.
static inline float rp_sum3(float a, float b, float c) {
    const float high = rp_max(rp_max(a, b), c), low = rp_min(rp_min(a, b), c);
    const float middle = rp_max(rp_min(a, b), rp_min(rp_max(a, b), c));
    return rp_add(rp_add(high, low), middle);
}

// 1 / x, with 0 and tiny values replaced by a huge reciprocal that keeps the sign, so that no product with it is NaN.
static inline float rp_safe_reciprocal(float x) { return 1.0f / (fabs(x) < 1e-18f ? copysign(1e-18f, x) : x); }

static inline float3 rp_load3(const __global float* p) { return (float3)(p[0], p[1], p[2]); }

// Octahedral unit vectors in 2 x 16 bits (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors").
static inline uint rp_encode_normal(float3 n) {
    const float scale = 1.0f / (fabs(n.x) + fabs(n.y) + fabs(n.z));
    float u = n.x * scale, v = n.y * scale;
    if (n.z < 0.0f) {
        const float t = u;
        u = copysign(1.0f - fabs(v), t);
        v = copysign(1.0f - fabs(t), v);
    }
    const int x = convert_int_rte(clamp(u, -1.0f, 1.0f) * 32767.0f), y = convert_int_rte(clamp(v, -1.0f, 1.0f) * 32767.0f);
    return (uint)(x & 0xffff) | (uint)(y & 0xffff) << 16;
}
static inline float3 rp_decode_normal(uint code) {
    float u = (float)(short)(code & 0xffffu) * (1.0f / 32767.0f), v = (float)(short)(code >> 16) * (1.0f / 32767.0f);
    const float z = 1.0f - fabs(u) - fabs(v);
    if (z < 0.0f) {
        const float t = u;
        u = copysign(1.0f - fabs(v), t);
        v = copysign(1.0f - fabs(t), v);
    }
    return normalize((float3)(u, v, z));
}

#endif
