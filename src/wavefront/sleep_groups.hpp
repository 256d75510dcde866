// What the host says of blocks to slots that sleep (abi/path.h, kernels/single_ray/wake.cl).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "raypager/abi/path.h"

namespace raypager {

inline constexpr uint64_t all_sleep_bits = (uint64_t{1} << RP_SLEEP_BITS) - 1;

// So that blocks are spread evenly over the bits, those that follow each other together.
inline uint32_t block_scale(uint64_t blocks, uint32_t shares) {
    return static_cast<uint32_t>(std::min((uint64_t{shares} << 32) / std::max<uint64_t>(blocks, 1), uint64_t{UINT32_MAX}));
}
inline uint32_t sleep_bit_scale(uint64_t blocks) { return block_scale(blocks, RP_SLEEP_BITS); }

// What stands for these blocks in the word of a sleeping group.
inline uint64_t sleep_bits(std::span<const uint32_t> blocks, uint32_t bit_scale) {
    uint64_t bits = 0;
    for (const uint32_t block : blocks) bits |= uint64_t{1} << (uint64_t{block} * bit_scale >> 32);
    return bits;
}

}  // namespace raypager
