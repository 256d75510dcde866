// Positions and ids as blocks store them (abi/block.h), where they are coded: see RP_POSITION_STRIDE and RP_IDS_CODED there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "raypager/abi/block.h"
#include "raypager/abi/instance.h"
#include "raypager/scene.hpp"

namespace raypager {

// The largest power of two that is not more than twice `error`: vertices that move to the nearest multiple of it move by at most `error` along each
// axis.
float position_cell(float error);
// Whether it is such a number, or 0, for positions that are not coded.
bool good_position_cell(float cell);

// Whether the block holds instances, and nothing else.
inline bool holds_instances(const rp_block_header& header) { return header.attributes_at & RP_BLOCK_INSTANCES; }

// Bytes of a block's sections. REQUIRES: good_coding(header).
uint64_t position_bytes(const rp_block_header& header);
uint64_t leaf_bytes(const rp_block_header& header);  // or instances with their numbers
uint64_t id_bytes(const rp_block_header& header);
uint64_t attribute_bytes(const rp_block_header& header);  // normals, colours and coordinates of textures of vertices
uint64_t colors_at(const rp_block_header& header);        // byte offset; REQUIRES: RP_BLOCK_COLORS
uint64_t uvs_at(const rp_block_header& header);           // likewise of RP_BLOCK_UVS
// Whether header.flags and what else says how positions and ids are coded make sense, in a scene with this cell.
bool good_coding(const rp_block_header& header, float cell);

// The positions of a block. REQUIRES: a section that holds position_bytes().
class BlockPositions {
public:
    BlockPositions(const rp_block_header& header, const std::byte* section)
        : section_(section),
          flags_(header.flags),
          base_{header.origin[3], header.cell[3], header.lower[3]},
          cell_(header.upper[3]),
          stride_(RP_POSITION_STRIDE(header.flags)) {}

    Float3 operator[](size_t index) const {
        if (stride_ == 0) {
            Float3 position;
            std::memcpy(&position, section_ + index * sizeof position, sizeof position);
            return position;
        }
        return decode(index);
    }
    // Between which corners all of them are, as far as their coding alone says; none if they are not coded. Also where a sum of base and offset is
    // not exact, as in files that nobody has baked: rounding keeps the order.
    std::optional<std::array<Float3, 2>> range() const;

private:
    Float3 decode(size_t index) const;

    const std::byte* section_;
    rp_u32 flags_;
    Float3 base_;
    float cell_;
    size_t stride_;
};

// Bits of a leaf's ids, where they are coded.
inline size_t id_bits_of_leaf(rp_u32 flags) { return RP_ID_FIRST_BITS(flags) + (RP_LEAF_MAX_PRIMITIVES - 1) * size_t{RP_ID_STEP_BITS(flags)}; }

// The ids of a block's triangles. REQUIRES: a section that holds id_bytes().
class BlockIds {
public:
    BlockIds(const rp_block_header& header, const std::byte* section)
        : section_(section),
          coded_((header.flags & RP_IDS_CODED) != 0),
          leaf_bits_(id_bits_of_leaf(header.flags)),
          first_bits_(RP_ID_FIRST_BITS(header.flags)),
          step_bits_(RP_ID_STEP_BITS(header.flags)) {}
    // Of triangle k, up to RP_LEAF_MAX_PRIMITIVES. Where a leaf has fewer: RP_NONE, or anything if ids are coded.
    rp_u32 operator()(size_t leaf, uint32_t k) const { return coded_ ? decode(leaf, k) : word(RP_LEAF_MAX_PRIMITIVES * leaf + k); }
    // Whether their coding alone says that all are less than `count`.
    bool all_below(uint64_t count) const;

private:
    rp_u32 word(size_t index) const {
        rp_u32 value;
        std::memcpy(&value, section_ + index * sizeof value, sizeof value);
        return value;
    }
    rp_u32 bits(size_t at, uint32_t width) const {
        const uint64_t both = uint64_t{word(2 + at / 32 + 1)} << 32 | word(2 + at / 32);
        return static_cast<rp_u32>(both >> at % 32 & ((uint64_t{1} << width) - 1));
    }
    rp_u32 decode(size_t leaf, uint32_t k) const {
        const size_t at = leaf * leaf_bits_;
        const rp_u32 first = word(0) + bits(at, first_bits_);
        return k == 0 ? first : first + word(1) + bits(at + first_bits_ + (k - 1) * step_bits_, step_bits_);
    }

    const std::byte* section_;
    bool coded_;
    size_t leaf_bits_;
    uint32_t first_bits_, step_bits_;
};

// Code the sections in as few bytes as they take, and say in `header` how. Every coordinate comes back to the bit: where positions are not multiples
// of `cell`, or lie too far apart, they stay as they are.
std::vector<std::byte> code_positions(std::span<const Float3> positions, float cell, rp_block_header& header);
// RP_LEAF_MAX_PRIMITIVES a leaf, unused ones RP_NONE.
std::vector<std::byte> code_ids(std::span<const rp_u32> ids, rp_block_header& header);

}  // namespace raypager
