// Vectors of eight and sixteen lanes as CPUs have them: bit masks of comparisons, permutations, the least lane. What more than one device
// needs has a portable form; where the compiler names the instruction set, one or a few instructions do it. tests/kernel compares both.
#ifndef RP_VECTOR_CL
#define RP_VECTOR_CL

#include "common/arithmetic.cl"
#include "common/bits.cl"

#if defined(__AVX512F__) && defined(__AVX512DQ__) && !defined(RP_PORTABLE)
#define RP_AVX512 1
#endif
#if defined(__AVX2__) && !defined(RP_PORTABLE)
#define RP_AVX2 1
#endif

// Bit k: lane k is true (a comparison's result: all bits set).
static inline uint rp_mask8(int8 lanes) {
#ifdef RP_AVX2
    return (uint)__builtin_ia32_movmskps256(as_float8(lanes));
#else
    const int8 bits = lanes & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
    const int4 four = bits.lo | bits.hi;
    const int2 two = four.lo | four.hi;
    return (uint)(two.x | two.y);
#endif
}
static inline uint rp_mask16(int16 lanes) {
#ifdef RP_AVX512
    return (uint)__builtin_ia32_cvtd2mask512(lanes);
#else
    return rp_mask8(lanes.lo) | rp_mask8(lanes.hi) << 8;
#endif
}

// Lane k: true if bit k is set.
static inline int16 rp_lanes16(uint mask) {
    return ((int16)((int)mask) & (int16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768)) != 0;
}

#ifdef RP_AVX512
// Lane k: values[index[k]].
static inline float16 rp_pick16(float16 values, uint16 index) { return __builtin_ia32_permvarsf512(values, as_int16(index)); }

// Lane k: of both vectors, one behind the other, value index[k] (0 to 31).
static inline float16 rp_pick_of_two16(float16 first, float16 second, uint16 index) {
    return __builtin_ia32_vpermi2varps512(first, as_int16(index), second);
}
#endif

// Lane k: values[index[k] % 8].
static inline float8 rp_pick8(float8 values, uint8 index) {
#ifdef RP_AVX2
    return __builtin_ia32_permvarsf256(values, as_int8(index));
#else
    float from[8];
    uint at[8];
    vstore8(values, 0, from);
    vstore8(index & 7u, 0, at);
    for (uint k = 0u; k < 8u; k++) at[k] = as_uint(from[at[k]]);
    return as_float8(vload8(0, at));
#endif
}

// Lane k: of both vectors, one behind the other, value index[k] (0 to 15).
static inline float8 rp_pick_of_two8(float8 first, float8 second, uint8 index) {
    // By the bit that makes the difference, moved to where blends look.
    return as_int8(index << 28) < 0 ? rp_pick8(second, index) : rp_pick8(first, index);
}

// Lane k: values[index[k]] (0 to 7).
static inline ulong8 rp_pick_long8(ulong8 values, uint8 index) {
#if defined(RP_AVX512)
    return as_ulong8(__builtin_ia32_permvardf512(as_double8(values), as_long8(convert_ulong8(index))));
#elif defined(RP_AVX2)
    // Halves of 32 bits, of all eight. Through memory it would be eight stores that a load then waits for.
    const float16 words = as_float16(values);
    const float8 low = rp_pick8(words.even, index), high = rp_pick8(words.odd, index);
    return as_ulong8((float16)(low.s0, high.s0, low.s1, high.s1, low.s2, high.s2, low.s3, high.s3, low.s4, high.s4, low.s5, high.s5, low.s6, high.s6,
                               low.s7, high.s7));
#else
    ulong from[8], picked[8];
    uint at[8];
    vstore8(values, 0, from);
    vstore8(index, 0, at);
    for (uint k = 0u; k < 8u; k++) picked[k] = from[at[k]];
    return vload8(0, picked);
#endif
}

// Sorted, the greatest first: Batcher's odd-even merge, whose six layers put two lanes each in order. No branch depends on the values.
#define RP_SORT_LAYER(partner, is_lower)                \
    do {                                                \
        const uint8 other = v.partner;                  \
        v = (is_lower) ? min(v, other) : max(v, other); \
    } while (0)
static inline uint8 rp_sort8(uint8 v) {
    RP_SORT_LAYER(s10325476, (int8)(0, -1, 0, -1, 0, -1, 0, -1));
    RP_SORT_LAYER(s23016745, (int8)(0, 0, -1, -1, 0, 0, -1, -1));
    RP_SORT_LAYER(s02134657, (int8)(0, 0, -1, 0, 0, 0, -1, 0));
    RP_SORT_LAYER(s45670123, (int8)(0, 0, 0, 0, -1, -1, -1, -1));
    RP_SORT_LAYER(s01452367, (int8)(0, 0, 0, 0, -1, -1, 0, 0));
    RP_SORT_LAYER(s02143657, (int8)(0, 0, -1, 0, -1, 0, -1, 0));
    return v;
}

static inline float rp_least8(float8 v) {
    const float4 four = rp_min(v.lo, v.hi);
    const float2 two = rp_min(four.lo, four.hi);
    return rp_min(two.x, two.y);
}
static inline float rp_least16(float16 v) { return rp_least8(rp_min(v.lo, v.hi)); }
static inline float rp_greatest16(float16 v) { return -rp_least16(-v); }

#endif
