// Numbers that look random and are the same each time.
#pragma once

#include <cstdint>

namespace raypager {

// Below range (at least 1), and depends on i alone (a step of SplitMix64).
inline uint64_t jitter(uint64_t i, uint64_t range) {
    uint64_t z = (i + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (z ^ z >> 31) % range;
}

// One from anywhere in the i-th of `count` equal stretches of [0, all): a fixed place in each might follow the rows of a regular mesh.
// REQUIRES: i < count <= all < 2^32.
inline uint64_t one_of_stretch(uint64_t i, uint64_t count, uint64_t all) {
    const uint64_t begin = all * i / count, end = all * (i + 1) / count;
    return begin + jitter(i, end - begin);
}

}  // namespace raypager
