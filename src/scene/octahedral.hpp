// Unit vectors in 32 bits (Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 2014, section 3.2):
// the sphere is projected onto an octahedron that is unfolded into the square [-1, 1]^2; u in bits 0-15, v in bits 16-31, each a signed
// number of 1/32767. kernels/common/arithmetic.cl decodes it.
#pragma once

#include <cmath>
#include <cstdint>

#include "raypager/abi/types.h"
#include "raypager/scene.hpp"

namespace raypager {

// The code of (x, y, z), which need not have unit length; RP_NONE if it has no direction.
inline uint32_t encode_octahedral(double x, double y, double z) {
    const double sum = std::abs(x) + std::abs(y) + std::abs(z);
    if (!(sum > 0) || !std::isfinite(sum)) return RP_NONE;
    double u = x / sum, v = y / sum;
    if (z < 0) {
        const double folded = std::copysign(1 - std::abs(v), u);
        v = std::copysign(1 - std::abs(u), v);
        u = folded;
    }
    const auto bits = [](double t) { return static_cast<uint32_t>(std::lround(t * 32767)) & 0xffffu; };
    const uint32_t code = bits(u) | bits(v) << 16;
    return code == RP_NONE ? 0x0000ffffu : code;  // the neighbouring code, where (-1, -1) would read as "none"
}

inline Float3 decode_octahedral(uint32_t code) {
    double u = static_cast<int16_t>(code & 0xffffu) / 32767.0, v = static_cast<int16_t>(code >> 16) / 32767.0;
    const double z = 1 - std::abs(u) - std::abs(v);
    if (z < 0) {
        const double folded = std::copysign(1 - std::abs(v), u);
        v = std::copysign(1 - std::abs(u), v);
        u = folded;
    }
    const double length = std::sqrt(u * u + v * v + z * z);
    return {static_cast<float>(u / length), static_cast<float>(v / length), static_cast<float>(z / length)};
}

}  // namespace raypager
