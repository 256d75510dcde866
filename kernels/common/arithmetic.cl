// Arithmetic that must come out the same wherever it is inlined: a product that no compiler may fuse with the following sum, minima and
// maxima of finite numbers, a reciprocal square root, and the decoding of grid coordinates.
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
// Byte k of eight; where k is a constant, and where it is not.
#define rp_byte(bytes, k) rp_byte_of_word((k) < 4u ? (bytes).x : (bytes).y, 0x4440u | ((k)&3u))
static inline uint rp_byte_of_word(uint word, uint selector) {
    uint r;
    asm("prmt.b32 %0, %1, 0, %2;" : "=r"(r) : "r"(word), "r"(selector));
    return r;
}
static inline uint rp_any_byte(uint2 bytes, uint k) {
    uint r;
    asm("prmt.b32 %0, %1, %2, %3;" : "=r"(r) : "r"(bytes.x), "r"(bytes.y), "r"(k));
    return r & 255u;
}
#define rp_min(a, b) fmin(a, b)
#define rp_max(a, b) fmax(a, b)
// An instruction, where root and division, both rounded correctly, are dozens. Not rounded correctly, but the same in all kernels.
#define rp_rsqrt(x) rsqrt(x)
// Of lengths from 1e-18 to 1e19. normalize takes care of any length: 45 instructions and a dozen branches.
static inline float3 rp_normalize(float3 v) {
    const float scale = rsqrt(fmax(rp_add(rp_add(rp_mul(v.x, v.x), rp_mul(v.y, v.y)), rp_mul(v.z, v.z)), 1e-36f));
    return (float3)(rp_mul(v.x, scale), rp_mul(v.y, scale), rp_mul(v.z, scale));
}
#else
#pragma OPENCL FP_CONTRACT OFF
static inline float rp_mul(float a, float b) { return a * b; }
static inline float rp_add(float a, float b) { return a + b; }
#define rp_byte(bytes, k) rp_any_byte(bytes, k)
static inline uint rp_any_byte(uint2 bytes, uint k) { return (k < 4u ? bytes.x >> 8u * k : bytes.y >> (8u * k - 32u)) & 255u; }
// Comparisons, not fmin: a CPU does them in one instruction.
#define rp_min(a, b) ((a) < (b) ? (a) : (b))
#define rp_max(a, b) ((a) > (b) ? (a) : (b))
// Not rsqrt, of which Intel's compiler has two, one for kernels that it makes vectors of: they differ in the last bit.
#define rp_rsqrt(x) (1.0f / sqrt(x))
static inline float3 rp_normalize(float3 v) { return normalize(v); }
#endif

// Rounded correctly, also in kernels that are built without that (Device::quick_arithmetic): for what two kernels must agree about, and where a whole
// divided by itself must be 1.
#ifdef RP_QUICK_ARITHMETIC
static inline float rp_div(float a, float b) {
    float r;
    asm("div.rn.f32 %0, %1, %2;" : "=f"(r) : "f"(a), "f"(b));
    return r;
}
static inline float rp_sqrt(float x) {
    float r;
    asm("sqrt.rn.f32 %0, %1;" : "=f"(r) : "f"(x));
    return r;
}
#else
#define rp_div(a, b) ((a) / (b))
#define rp_sqrt(x) sqrt(x)
#endif

// Grid coordinate (abi/block.h) of the near or far plane of an axis. The selector of an axis says which half of the word is near.
#ifdef RP_NV_DOT
// One product of both halves with two of the selector's bytes, 128 and 0, shifts the one and drops the other. GPUs do that where they multiply,
// which is idle more often than where they permute bytes and compare (bench/journal/gpu-traversal.md).
#define RP_NEAR_IS_LOWER 0x80000080u
#define RP_NEAR_IS_UPPER 0x00808000u
static inline float rp_grid_near(uint word, uint selector) {
    uint r;
    asm("dp2a.lo.u32.u32 %0, %1, %2, %3;" : "=r"(r) : "r"(word), "r"(selector), "r"(0x47000000u));
    return as_float(r);
}
static inline float rp_grid_far(uint word, uint selector) {
    uint r;
    asm("dp2a.hi.u32.u32 %0, %1, %2, %3;" : "=r"(r) : "r"(word), "r"(selector), "r"(0x47000000u));
    return as_float(r);
}
#else
#define RP_NEAR_IS_LOWER 0u
#define RP_NEAR_IS_UPPER 16u
static inline float rp_grid_near(uint word, uint selector) { return as_float(0x47000000u | (word >> selector & 0xffffu) << 7); }
static inline float rp_grid_far(uint word, uint selector) { return as_float(0x47000000u | (word >> (16u - selector) & 0xffffu) << 7); }
#endif

// 1 / x, with 0 and tiny values replaced by a huge reciprocal that keeps the sign, so that no product with it is NaN.
static inline float rp_safe_reciprocal(float x) { return 1.0f / (fabs(x) < 1e-18f ? copysign(1e-18f, x) : x); }

static inline float3 rp_load3(const __global float* p) { return (float3)(p[0], p[1], p[2]); }

#endif
