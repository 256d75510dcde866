#include "wide/leaf.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/check.hpp"
#include "wide/strip.hpp"

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
      normals(header.normals_at ? section<rp_u32>(bytes, header.normals_at) : nullptr) {}

namespace {

uint32_t triangle_count(rp_u32 ref) { return (ref & 3u) + 1; }
uint32_t sphere_count(rp_u32 ref) { return (ref & (RP_LEAF_MAX_SPHERES - 1)) + 1; }

float radius_of(const rp_sphere& sphere, rp_u32 ref) {
    const uint32_t of_point = ((sphere.word & 255u) << RP_POINT_RADIUS_SHIFT) + RP_POINT_RADIUS_BIAS;
    return std::bit_cast<float>(ref & RP_LEAF_POINTS ? of_point : sphere.word);
}

}  // namespace

LeafContent content_of_leaf(rp_u32 ref) {
    LeafContent content;
    if (ref & RP_LEAF_SPHERES) {
        (ref & RP_LEAF_POINTS ? content.points : content.spheres) = sphere_count(ref);
    } else {
        content.triangles = triangle_count(ref);
        content.vertices = content.triangles + 2;
    }
    return content;
}

Box bounds_of_leaf(const StoredBlock& block, rp_u32 ref) {
    Box box;
    if (!(ref & RP_LEAF_SPHERES)) {
        rp_u32 vertices[RP_LEAF_MAX_PRIMITIVES + 2];
        strip_vertices(block, ref, vertices);
        for (uint32_t i = 0; i < triangle_count(ref) + 2; i++) box.grow(block.vertices[vertices[i]]);
        return box;
    }
    constexpr float inf = std::numeric_limits<float>::infinity(), largest = std::numeric_limits<float>::max();
    for (uint32_t k = 0; k < sphere_count(ref); k++) {
        const rp_sphere& stored = block.spheres[leaf_index(ref) + k];
        const float radius = radius_of(stored, ref);
        Box sphere;
        for (int a = 0; a < 3; a++) {
            sphere.lower[a] = std::max(std::nextafter(stored.center[a] - radius, -inf), -largest);
            sphere.upper[a] = std::min(std::nextafter(stored.center[a] + radius, inf), largest);
        }
        box.grow(sphere);
    }
    return box;
}

void WideLeaf::clear() {
    vertex_count_ = triangles_ = sphere_count_ = 0;
    has_normals_ = are_points_ = false;
}

bool WideLeaf::add(const StoredBlock& block, rp_u32 ref) { return ref & RP_LEAF_SPHERES ? add_spheres(block, ref) : add_strip(block, ref); }

uint32_t WideLeaf::number(const Vertex& vertex) {
    // Bits, not values: -0 and 0 stay apart, as they do in the stored block.
    const auto bits = [](const Vertex& v) { return std::bit_cast<std::array<uint64_t, 2>>(v); };
    const std::array<uint64_t, 2> wanted = bits(vertex);
    const auto same = [&](const Vertex& other) { return ((bits(other)[0] ^ wanted[0]) | (bits(other)[1] ^ wanted[1])) == 0; };
    const auto end = vertices_.begin() + vertex_count_;
    const auto found = std::find_if(vertices_.begin(), end, same);
    if (found == end && vertex_count_ < RP_WIDE_LEAF_VERTICES) vertices_[vertex_count_++] = vertex;
    return static_cast<uint32_t>(found - vertices_.begin());
}

bool WideLeaf::add_strip(const StoredBlock& block, rp_u32 ref) {
    if (sphere_count_ > 0 || triangles_ + triangle_count(ref) > RP_WIDE_LEAF_TRIANGLES) return false;
    rp_u32 vertices[RP_LEAF_MAX_PRIMITIVES + 2], numbers[RP_LEAF_MAX_PRIMITIVES + 2];
    strip_vertices(block, ref, vertices);
    for (uint32_t i = 0; i < triangle_count(ref) + 2; i++) {
        const Vertex vertex = {block.vertices[vertices[i]], block.normals ? block.normals[vertices[i]] : RP_NONE};
        has_normals_ |= vertex.normal != RP_NONE;
        numbers[i] = number(vertex);
        if (numbers[i] == RP_WIDE_LEAF_VERTICES) return false;
    }
    visit_strip(ref, numbers, [&](uint32_t k, rp_u32 a, rp_u32 b, rp_u32 c) {
        ids_[triangles_] = block.ids(leaf_index(ref), k);
        corners_[triangles_++] = {static_cast<rp_u8>(a), static_cast<rp_u8>(b), static_cast<rp_u8>(c)};
    });
    return true;
}

bool WideLeaf::add_spheres(const StoredBlock& block, rp_u32 ref) {
    const bool are_points = ref & RP_LEAF_POINTS;
    if (triangles_ > 0 || sphere_count_ + sphere_count(ref) > RP_WIDE_LEAF_SPHERES || (sphere_count_ > 0 && are_points != are_points_)) return false;
    are_points_ = are_points;
    for (uint32_t k = 0; k < sphere_count(ref); k++) {
        spheres_[sphere_count_] = block.spheres[leaf_index(ref) + k];
        ids_[sphere_count_++] = block.sphere_ids[leaf_index(ref) + k];
    }
    return true;
}

void WideLeaf::append_to(std::vector<std::byte>& bytes, uint32_t block_index) const {
    RAYPAGER_CHECK(triangles_ + sphere_count_ > 0);
    const bool triangles = triangles_ > 0;
    const rp_wide_leaf head = {static_cast<rp_u8>(triangles ? RP_WIDE_TRIANGLES : RP_WIDE_SPHERES),
                               static_cast<rp_u8>(triangles ? triangles_ : sphere_count_), static_cast<rp_u8>(vertex_count_),
                               static_cast<rp_u8>((has_normals_ ? RP_WIDE_NORMALS : 0) | (are_points_ ? RP_WIDE_POINTS : 0)), block_index};
    // Room for all of it first, since it is written in very small parts; what is behind the last one stays zero.
    const size_t begin = bytes.size(), most = sizeof head + vertex_count_ * sizeof(Vertex) + triangles_ * (3 + sizeof(rp_u32)) +
                                              sphere_count_ * (sizeof spheres_[0] + sizeof(rp_u32)) + 2 * sizeof spheres_[0];
    bytes.resize(begin + most);
    size_t end = begin;
    const auto append = [&](const void* items, size_t size) {
        RAYPAGER_CHECK(end + size <= bytes.size());
        std::memcpy(bytes.data() + end, items, size);
        end += size;
    };
    const auto pad = [&](size_t unit) { end = (end + unit - 1) / unit * unit; };
    append(&head, sizeof head);
    if (triangles) {
        for (float Float3::*axis : {&Float3::x, &Float3::y, &Float3::z})
            for (uint32_t v = 0; v < vertex_count_; v++) append(&(vertices_[v].position.*axis), sizeof(float));
        for (uint32_t corner = 0; corner < 3; corner++)
            for (uint32_t k = 0; k < triangles_; k++) append(&corners_[k][corner], 1);
        pad(sizeof(rp_u32));
        append(ids_.data(), triangles_ * sizeof(rp_u32));
        if (has_normals_)
            for (uint32_t v = 0; v < vertex_count_; v++) append(&vertices_[v].normal, sizeof(rp_u32));
    } else {
        pad(sizeof spheres_[0]);
        append(spheres_.data(), sphere_count_ * sizeof spheres_[0]);
        append(ids_.data(), sphere_count_ * sizeof(rp_u32));
    }
    bytes.resize((end + RP_WIDE_UNIT - 1) / RP_WIDE_UNIT * RP_WIDE_UNIT);
}

}  // namespace raypager
