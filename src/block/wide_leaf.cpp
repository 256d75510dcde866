#include "block/wide_leaf.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/check.hpp"
#include "base/next_float.hpp"
#include "block/visit_strip.hpp"

namespace raypager {
namespace {

template <class T>
const T* section(std::span<const std::byte> bytes, uint64_t at) {
    return reinterpret_cast<const T*>(bytes.data() + at);
}

uint32_t leaf_index(rp_u32 ref) { return ref >> RP_LEAF_INDEX_SHIFT & RP_LEAF_INDEX_MASK; }

// The vertices of a strip, as many as it has triangles and two more.
void strip_vertices(const StoredBlock& block, rp_u32 ref, rp_u32 (&vertices)[RP_LEAF_MAX_PRIMITIVES + 2]) {
    const rp_leaf& leaf = block.leaves[leaf_index(ref)];
    const rp_u32 first = (leaf.lo & 0xffffu) * RP_CLUSTER_UNIT;
    const rp_u32 offsets[] = {leaf.lo >> 16 & 255u, leaf.lo >> 24, leaf.hi & 255u, leaf.hi >> 8 & 255u, leaf.hi >> 16 & 255u, leaf.hi >> 24};
    for (size_t i = 0; i < std::size(vertices); i++) vertices[i] = first + offsets[i];
}

}  // namespace

rp_block_header StoredBlock::header_of(std::span<const std::byte> bytes) {
    rp_block_header header;
    RAYPAGER_CHECK(bytes.size() >= sizeof header && reinterpret_cast<uintptr_t>(bytes.data()) % 4 == 0);
    std::memcpy(&header, bytes.data(), sizeof header);
    return header;
}

StoredBlock::StoredBlock(std::span<const std::byte> bytes)
    : header(header_of(bytes)),
      nodes(section<rp_node>(bytes, header.nodes_at)),
      leaves(section<rp_leaf>(bytes, header.leaves_at)),
      vertices(header, bytes.data() + header.vertices_at),
      spheres(section<rp_sphere>(bytes, header.spheres_at)),
      sphere_ids(reinterpret_cast<const rp_u32*>(spheres + header.sphere_count)),
      ids(header, bytes.data() + header.ids_at),
      normals(header.flags & RP_BLOCK_NORMALS ? section<rp_u32>(bytes, RP_BLOCK_ATTRIBUTES_AT(header.attributes_at)) : nullptr),
      colors(header.flags & RP_BLOCK_COLORS ? section<rp_u32>(bytes, colors_at(header)) : nullptr),
      uvs(RP_BLOCK_HAS_UVS(header.attributes_at) ? section<Float2>(bytes, uvs_at(header)) : nullptr) {}

namespace {

float radius_of(const rp_sphere& sphere, rp_u32 flags) {
    const uint32_t of_point = ((sphere.word & 255u) << RP_POINT_RADIUS_SHIFT) + RP_POINT_RADIUS_BIAS;
    return std::bit_cast<float>(flags & RP_LEAF_POINTS ? of_point : sphere.word);
}

}  // namespace

Box bounds_of_spheres(const rp_sphere* spheres, rp_u32 flags) {
    constexpr float largest = std::numeric_limits<float>::max();
    Box box;
    for (const rp_sphere& stored : std::span(spheres, spheres_of_leaf(flags))) {
        const float radius = radius_of(stored, flags);
        Box sphere;
        for (int a = 0; a < 3; a++) {
            sphere.lower[a] = std::max(next_below(stored.center[a] - radius), -largest);
            sphere.upper[a] = std::min(next_above(stored.center[a] + radius), largest);
        }
        box.grow(sphere);
    }
    return box;
}

Box bounds_of_leaf(const StoredBlock& block, rp_u32 ref) {
    if (ref & RP_LEAF_SPHERES) return bounds_of_spheres(block.spheres + leaf_index(ref), ref);
    Box box;
    rp_u32 vertices[RP_LEAF_MAX_PRIMITIVES + 2];
    strip_vertices(block, ref, vertices);
    for (uint32_t i = 0; i < triangles_of_leaf(ref) + 2; i++) box.grow(block.vertices[vertices[i]]);
    return box;
}

bool WideLeaf::add(const StoredBlock& block, rp_u32 ref) {
    if (!(ref & RP_LEAF_SPHERES)) return add_strip(block, ref);
    const uint32_t before = size_.spheres;
    if (!size_.add(ref)) return false;
    std::copy_n(block.spheres + leaf_index(ref), spheres_of_leaf(ref), spheres_.begin() + before);
    std::copy_n(block.sphere_ids + leaf_index(ref), spheres_of_leaf(ref), ids_.begin() + before);
    return true;
}

uint32_t WideLeaf::number(const Vertex& vertex) {
    // Bits, not values: -0 and 0 stay apart, as they do in the stored block.
    using Bits = std::array<uint32_t, 7>;
    const auto wanted = std::bit_cast<Bits>(vertex);
    const auto same = [&](const Vertex& other) { return std::bit_cast<Bits>(other) == wanted; };
    const auto end = vertices_.begin() + size_.vertices;
    const auto found = std::find_if(vertices_.begin(), end, same);
    if (found == end && size_.vertices < RP_WIDE_LEAF_VERTICES) vertices_[size_.vertices++] = vertex;
    return static_cast<uint32_t>(found - vertices_.begin());
}

bool WideLeaf::add_strip(const StoredBlock& block, rp_u32 ref) {
    const uint32_t before = size_.triangles;
    if (!size_.add(ref)) return false;
    rp_u32 vertices[RP_LEAF_MAX_PRIMITIVES + 2], numbers[RP_LEAF_MAX_PRIMITIVES + 2];
    strip_vertices(block, ref, vertices);
    for (uint32_t i = 0; i < triangles_of_leaf(ref) + 2; i++) {
        const Vertex vertex = {block.vertices[vertices[i]], block.normals ? block.normals[vertices[i]] : RP_NONE,
                               block.colors ? block.colors[vertices[i]] : RP_NONE, block.uvs ? block.uvs[vertices[i]] : Float2{}};
        size_.has_normals |= vertex.normal != RP_NONE;
        size_.has_colors |= vertex.color != RP_NONE;
        size_.has_uvs |= vertex.uv != Float2{};
        numbers[i] = number(vertex);
        if (numbers[i] == RP_WIDE_LEAF_VERTICES) return false;
    }
    visit_strip(ref, numbers, [&](uint32_t k, rp_u32 a, rp_u32 b, rp_u32 c) {
        ids_[before + k] = block.ids(leaf_index(ref), k);
        corners_[before + k] = {static_cast<rp_u8>(a), static_cast<rp_u8>(b), static_cast<rp_u8>(c)};
    });
    return true;
}

void WideLeaf::append_to(std::vector<std::byte>& bytes, uint32_t block_index) const {
    RAYPAGER_CHECK(size_.triangles + size_.spheres > 0);
    const bool triangles = size_.triangles > 0;
    const rp_wide_leaf head = {static_cast<rp_u8>(triangles ? RP_WIDE_TRIANGLES : RP_WIDE_SPHERES),
                               static_cast<rp_u8>(triangles ? size_.triangles : size_.spheres), static_cast<rp_u8>(size_.vertices),
                               static_cast<rp_u8>((size_.has_normals ? RP_WIDE_NORMALS : 0) | (size_.has_colors ? RP_WIDE_COLORS : 0) |
                                                  (size_.has_uvs ? RP_WIDE_UVS : 0) | (size_.are_points ? RP_WIDE_POINTS : 0)),
                               block_index};
    const WideLeafSize::Places at = size_.places();
    const size_t begin = bytes.size();
    bytes.resize(begin + at.end);  // what nothing is written to stays zero
    std::byte* const record = bytes.data() + begin;
    std::memcpy(record, &head, sizeof head);
    if (triangles) {
        std::byte* out = record + at.first;
        for (float Float3::*axis : {&Float3::x, &Float3::y, &Float3::z})
            for (uint32_t v = 0; v < size_.vertices; v++, out += sizeof(float)) std::memcpy(out, &(vertices_[v].position.*axis), sizeof(float));
        for (uint32_t corner = 0; corner < 3; corner++)
            for (uint32_t k = 0; k < size_.triangles; k++) *out++ = std::byte{corners_[k][corner]};
        if (size_.has_normals)
            for (uint32_t v = 0; v < size_.vertices; v++) std::memcpy(record + at.normals + v * sizeof(rp_u32), &vertices_[v].normal, sizeof(rp_u32));
        if (size_.has_colors)
            for (uint32_t v = 0; v < size_.vertices; v++) std::memcpy(record + at.colors + v * sizeof(rp_u32), &vertices_[v].color, sizeof(rp_u32));
        if (size_.has_uvs) {
            out = record + at.uvs;
            for (float Float2::*axis : {&Float2::x, &Float2::y})
                for (uint32_t v = 0; v < size_.vertices; v++, out += sizeof(float)) std::memcpy(out, &(vertices_[v].uv.*axis), sizeof(float));
        }
    } else {
        std::memcpy(record + at.first, spheres_.data(), size_.spheres * sizeof spheres_[0]);
    }
    std::memcpy(record + at.ids, ids_.data(), head.count * sizeof(rp_u32));
}

}  // namespace raypager
