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

}  // namespace raypager
