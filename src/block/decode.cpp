#include "block/decode.hpp"

#include <bit>
#include <cstring>

#include "base/check.hpp"
#include "block/block_coding.hpp"
#include "block/point_code.hpp"
#include "block/strip.hpp"

namespace raypager {
namespace {

template <class T>
std::span<const T> section(std::span<const std::byte> bytes, uint64_t at, uint64_t count) {
    RAYPAGER_CHECK(at <= bytes.size() && count * sizeof(T) <= bytes.size() - at);
    return {reinterpret_cast<const T*>(bytes.data() + at), count};
}

void decode_strip(const BlockView& block, rp_u32 ref, uint32_t index, DecodedLeaf& out) {
    const rp_leaf& leaf = block.leaves[index];
    const rp_u32 first = (leaf.lo & 0xffffu) * RP_CLUSTER_UNIT;
    const rp_u32 vertices[RP_LEAF_MAX_PRIMITIVES + 2] = {first + (leaf.lo >> 16 & 255u), first + (leaf.lo >> 24),        first + (leaf.hi & 255u),
                                                         first + (leaf.hi >> 8 & 255u),  first + (leaf.hi >> 16 & 255u), first + (leaf.hi >> 24)};
    visit_strip(ref, vertices, [&](uint32_t k, rp_u32 a, rp_u32 b, rp_u32 c) {
        DecodedTriangle triangle = {block.ids[RP_LEAF_MAX_PRIMITIVES * index + k], {}, {RP_NONE, RP_NONE, RP_NONE}, {RP_NONE, RP_NONE, RP_NONE}, {}};
        const rp_u32 corners[3] = {a, b, c};
        for (int i = 0; i < 3; i++) {
            triangle.vertices[i] = block.vertices[corners[i]];
            if (!block.normals.empty()) triangle.normals[i] = block.normals[corners[i]];
            if (!block.colors.empty()) triangle.colors[i] = block.colors[corners[i]];
            if (!block.uvs.empty()) triangle.uvs[i] = block.uvs[corners[i]];
        }
        out.triangles.push_back(triangle);
    });
}

}  // namespace

BlockView::BlockView(std::span<const std::byte> bytes) {
    RAYPAGER_CHECK(bytes.size() >= sizeof header && reinterpret_cast<uintptr_t>(bytes.data()) % 8 == 0);
    std::memcpy(&header, bytes.data(), sizeof header);
    RAYPAGER_CHECK(!holds_instances(header));
    nodes = section<rp_node>(bytes, header.nodes_at, header.node_count);
    leaves = section<rp_leaf>(bytes, header.leaves_at, header.leaf_count);
    const BlockPositions positions(header, section<std::byte>(bytes, header.vertices_at, position_bytes(header)).data());
    for (uint32_t i = 0; i < header.vertex_count; i++) vertices.push_back(positions[i]);
    spheres = section<rp_sphere>(bytes, header.spheres_at, header.sphere_count);
    sphere_ids = section<rp_u32>(bytes, header.spheres_at + header.sphere_count * uint64_t{sizeof(rp_sphere)}, header.sphere_count);
    const BlockIds all_ids(header, section<std::byte>(bytes, header.ids_at, id_bytes(header)).data());
    for (uint32_t leaf = 0; leaf < header.leaf_count; leaf++)
        for (uint32_t k = 0; k < RP_LEAF_MAX_PRIMITIVES; k++) ids.push_back(all_ids(leaf, k));
    if (header.flags & RP_BLOCK_NORMALS) normals = section<rp_u32>(bytes, RP_BLOCK_ATTRIBUTES_AT(header.attributes_at), header.vertex_count);
    if (header.flags & RP_BLOCK_COLORS) colors = section<rp_u32>(bytes, colors_at(header), header.vertex_count);
    if (RP_BLOCK_HAS_UVS(header.attributes_at)) uvs = section<Float2>(bytes, uvs_at(header), header.vertex_count);
}

void decode_leaf(const BlockView& block, rp_u32 ref, DecodedLeaf& out) {
    const uint32_t index = ref >> RP_LEAF_INDEX_SHIFT & RP_LEAF_INDEX_MASK;
    if (!(ref & RP_LEAF_SPHERES)) return decode_strip(block, ref, index, out);
    const bool points = ref & RP_LEAF_POINTS;
    for (uint32_t i = index; i <= index + (ref & (RP_LEAF_MAX_SPHERES - 1)); i++) {
        const rp_sphere& s = block.spheres[i];
        const float radius = points ? point_radius(s.word & 255u) : std::bit_cast<float>(s.word);
        out.spheres.push_back({block.sphere_ids[i], {s.center[0], s.center[1], s.center[2]}, radius, points ? s.word : RP_NONE});
    }
}

DecodedLeaf decode_subtree(const BlockView& block, rp_u32 ref) {
    DecodedLeaf out;
    std::vector<rp_u32> stack = {ref};
    while (!stack.empty()) {
        const rp_u32 top = stack.back();
        stack.pop_back();
        if (top & RP_REF_LEAF) {
            decode_leaf(block, top, out);
            continue;
        }
        for (const int side : {1, 0}) stack.push_back(block.nodes[top].child[side].ref);
    }
    return out;
}

}  // namespace raypager
