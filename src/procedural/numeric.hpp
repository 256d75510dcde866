// Numbers that come out the same on every machine: integer hashes, and elementary functions built from additions and multiplications
// alone (those of the C library differ in the last bit from one version to the next). Compiled without fused operations.
#pragma once

#include <array>
#include <cstdint>

#include "scene/vector.hpp"

namespace raypager {

// A bijection on 64 bits in which every input bit affects every output bit (the finaliser of SplitMix64; Steele et al. 2014).
inline uint64_t mix_bits(uint64_t x) {
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9u;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

// A stream of random numbers (SplitMix64); streams of different (seed, stream) are unrelated.
class Random {
public:
    explicit Random(uint64_t seed, uint64_t stream = 0) : state_(mix_bits(seed + 0x9e3779b97f4a7c15u * (mix_bits(stream) | 1))) {}
    uint64_t bits() { return mix_bits(state_ += 0x9e3779b97f4a7c15u); }
    double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }  // [0, 1)
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    uint32_t below(uint32_t count) { return static_cast<uint32_t>((bits() >> 32) * count >> 32); }  // [0, count)
    double bell();       // mean 0, standard deviation 1, within [-3.5, 3.5]: a sum of uniform numbers
    Vector direction();  // uniform on the unit sphere

private:
    uint64_t state_;
};

struct SinCos {
    double sin, cos;
};
// Of 2 pi turns.
SinCos sincos_turns(double turns);

// 0 below low, 1 above high, smooth between.
double smooth_step(double low, double high, double x);

}  // namespace raypager
