// The leaves of a wide tree: a few neighbouring leaves of the stored tree in one record.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "block/block_coding.hpp"
#include "block/wide_leaf_content.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/wide.h"
#include "raypager/scene.hpp"
#include "scene/box.hpp"

namespace raypager {

// Typed views of a stored block's sections.
struct StoredBlock {
    explicit StoredBlock(std::span<const std::byte> bytes);
    rp_block_header header;
    const rp_node* nodes;
    const rp_leaf* leaves;
    BlockPositions vertices;
    const rp_sphere* spheres;
    const rp_u32* sphere_ids;
    BlockIds ids;
    const rp_u32 *normals, *colors;  // one per vertex, or null
    const Float2* uvs;               // likewise

private:
    static rp_block_header header_of(std::span<const std::byte> bytes);
};

// Bounds of a leaf's primitives. flags: bits 0-6 of its reference.
Box bounds_of_spheres(const rp_sphere* spheres, rp_u32 flags);
Box bounds_of_leaf(const StoredBlock& block, rp_u32 ref);

// One leaf record in the making.
class WideLeaf {
public:
    void clear() { size_ = {}; }
    // Adds a stored leaf. False if the record would have too many primitives or vertices; it then is of no use.
    bool add(const StoredBlock& block, rp_u32 ref);
    void append_to(std::vector<std::byte>& bytes, uint32_t block_index) const;

private:
    struct Vertex {
        Float3 position;
        rp_u32 normal, color;
        Float2 uv;
    };
    bool add_strip(const StoredBlock& block, rp_u32 ref);
    // Number of the vertex in this leaf; RP_WIDE_LEAF_VERTICES if there is no room.
    uint32_t number(const Vertex& vertex);

    std::array<Vertex, RP_WIDE_LEAF_VERTICES> vertices_;
    std::array<std::array<rp_u8, 3>, RP_WIDE_LEAF_TRIANGLES> corners_;
    std::array<rp_sphere, RP_WIDE_LEAF_SPHERES> spheres_;
    std::array<rp_u32, std::max(RP_WIDE_LEAF_SPHERES, RP_WIDE_LEAF_TRIANGLES)> ids_;
    WideLeafSize size_;
};

}  // namespace raypager
