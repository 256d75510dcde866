// Random numbers (random.cl) on RP_LANES lanes.
#include "common/begin_lanes.cl"

typedef struct RP_NAME(rp_numbers_) {
    RP_UINTS x, y, z, w;
} RP_NAME(rp_numbers_);

// pcg4d: Jarzynski and Olano 2020, "Hash Functions for GPU Rendering".
static inline RP_NAME(rp_numbers_) RP_NAME(rp_hash_)(RP_UINTS x, RP_UINTS y, RP_UINTS z, RP_UINTS w) {
    x = x * 1664525u + 1013904223u;
    y = y * 1664525u + 1013904223u;
    z = z * 1664525u + 1013904223u;
    w = w * 1664525u + 1013904223u;
    x += y * w;
    y += z * x;
    z += x * y;
    w += y * z;
    x ^= x >> 16u;
    y ^= y >> 16u;
    z ^= z >> 16u;
    w ^= w >> 16u;
    x += y * w;
    y += z * x;
    z += x * y;
    w += y * z;
    const RP_NAME(rp_numbers_) r = {x, y, z, w};
    return r;
}

static inline RP_UINTS RP_NAME(rp_reverse_bits_)(RP_UINTS v) {
    v = (v >> 1u & 0x55555555u) | (v & 0x55555555u) << 1u;
    v = (v >> 2u & 0x33333333u) | (v & 0x33333333u) << 2u;
    v = (v >> 4u & 0x0f0f0f0fu) | (v & 0x0f0f0f0fu) << 4u;
    v = (v >> 8u & 0x00ff00ffu) | (v & 0x00ff00ffu) << 8u;
    return v >> 16u | v << 16u;
}

// Owen's scrambling of numbers whose bits are reversed: each bit is flipped or not, as a hash of the bits below it says. Laine and Karras 2011,
// "Stratified Sampling for Stochastic Transparency", with the better mixing that Vegdahl found in 2021.
static inline RP_UINTS RP_NAME(rp_scramble_reversed_)(RP_UINTS v, RP_UINTS seed) {
    v ^= v * 0x3d20adeau;
    v += seed;
    v *= seed >> 16u | 1u;
    v ^= v * 0x05526c56u;
    return v ^ v * 0x53a22864u;
}

// Another seed for a number than that of the order of its pair.
static inline RP_UINTS RP_NAME(rp_flips_)(RP_UINTS order) {
    const RP_UINTS v = (order ^ order >> 16u) * 0x7feb352du;
    return v ^ v >> 15u;
}

// The second coordinate of Sobol's sequence, bits reversed, of point v: its matrix is Pascal's triangle modulo 2.
static inline RP_UINTS RP_NAME(rp_sobol_reversed_)(RP_UINTS v) {
    v ^= v >> 1u & 0x55555555u;
    v ^= v >> 2u & 0x33333333u;
    v ^= v >> 4u & 0x0f0f0f0fu;
    v ^= v >> 8u & 0x00ff00ffu;
    return v ^ v >> 16u;
}

// Four uniform 32-bit numbers: two pairs. seed: the render's.
static inline RP_NAME(rp_numbers_) RP_NAME(rp_random_bits_)(RP_UINTS pixel, RP_UINTS sample, RP_UINTS depth, uint purpose, uint seed) {
    const RP_NAME(rp_numbers_) order = RP_NAME(rp_hash_)(pixel, depth << 4u | purpose, (RP_UINTS)(seed), (RP_UINTS)(0u));
    const RP_UINTS reversed = RP_NAME(rp_reverse_bits_)(sample);
    const RP_UINTS xy = RP_NAME(rp_reverse_bits_)(RP_NAME(rp_scramble_reversed_)(reversed, order.x));
    const RP_UINTS zw = RP_NAME(rp_reverse_bits_)(RP_NAME(rp_scramble_reversed_)(reversed, order.y));
    RP_NAME(rp_numbers_) r;
    r.x = RP_NAME(rp_reverse_bits_)(RP_NAME(rp_scramble_reversed_)(xy, RP_NAME(rp_flips_)(order.x)));
    r.y = RP_NAME(rp_reverse_bits_)(RP_NAME(rp_scramble_reversed_)(RP_NAME(rp_sobol_reversed_)(xy), RP_NAME(rp_flips_)(order.y)));
    r.z = RP_NAME(rp_reverse_bits_)(RP_NAME(rp_scramble_reversed_)(zw, RP_NAME(rp_flips_)(order.z)));
    r.w = RP_NAME(rp_reverse_bits_)(RP_NAME(rp_scramble_reversed_)(RP_NAME(rp_sobol_reversed_)(zw), RP_NAME(rp_flips_)(order.w)));
    return r;
}

// A number in [0, 1).
static inline RP_FLOATS RP_NAME(rp_unit_)(RP_UINTS bits) { return RP_TO_FLOATS(RP_AS_INTS(bits >> 8u)) * 0x1p-24f; }

#include "common/end_lanes.cl"
