// All primitives of a scene, in world space, or of an object, in its own; or all instances: as the cut and the builders of blocks see them.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/huge_pages.hpp"
#include "raypager/abi/instance.h"
#include "raypager/abi/types.h"
#include "raypager/scene.hpp"
#include "scene/box4.hpp"
#include "world/vertex_table.hpp"

namespace raypager {

struct WorldSphere {
    Float3 center;
    float radius;                   // of a point: exactly what its word says
    uint32_t point_word = RP_NONE;  // of a point of a coloured cloud (abi/block.h; RP_NONE is none, for it has code 255); a sphere: RP_NONE
    bool is_point() const { return point_word != RP_NONE; }
};

// Which attributes vertices have beside a position.
struct VertexAttributes {
    bool normals = false, colors = false, uvs = false;
    uint32_t vertex_bytes() const { return 12 + (normals ? 4 : 0) + (colors ? 4 : 0) + (uvs ? 8 : 0); }  // in a block, positions uncoded
};

struct WorldInstance {
    rp_instance record;  // but for its path, which is known when its block is packed
    Box box;
    uint32_t number;  // in the scene
};

// The kinds of leaves in blocks.
enum class PrimitiveKind { triangle, sphere, point, instance };

// Instances are in worlds of their own: their blocks hold nothing else.
struct World {
    UnwrittenVector<Float3> positions;
    std::vector<uint32_t> normals;  // octahedral, one per position, RP_NONE where there is none; empty: no shape has any
    std::vector<uint32_t> colors;   // likewise; as in abi/block.h
    std::vector<Float2> uvs;        // of the first so many vertices, zeros where there are none: the others have none
    // A triangle: its vertices, counter-clockwise seen from the side of its normal.
    // A sphere or a point: sphere_entry. An instance: instance_entry.
    std::vector<Triangle> primitives;
    UnwrittenVector<WorldSphere> spheres;
    std::vector<WorldInstance> instances;
    // Of the primitives, where these are only some of those that were gathered; empty: primitive i has the id i.
    std::vector<uint32_t> ids;
    uint32_t first_id = 0;  // in the scene, of what was gathered: comes on top
    Box bounds;

    // In the place of vertices: a sphere's number among the spheres, and what no vertex is called.
    static Triangle sphere_entry(size_t number) { return {static_cast<uint32_t>(number), RP_NONE, RP_NONE}; }
    static Triangle instance_entry(size_t number) { return {static_cast<uint32_t>(number), RP_NONE, 0}; }
    // Points, too.
    bool is_sphere(uint32_t primitive) const { return primitives[primitive][2] == RP_NONE; }
    bool is_triangle(uint32_t primitive) const { return primitives[primitive][1] != RP_NONE; }
    PrimitiveKind kind(uint32_t primitive) const {
        if (is_triangle(primitive)) return PrimitiveKind::triangle;
        if (!is_sphere(primitive)) return PrimitiveKind::instance;
        return sphere(primitive).is_point() ? PrimitiveKind::point : PrimitiveKind::sphere;
    }
    const WorldSphere& sphere(uint32_t primitive) const { return spheres[primitives[primitive][0]]; }
    const WorldInstance& instance(uint32_t primitive) const { return instances[primitives[primitive][0]]; }
    uint32_t id(uint32_t primitive) const { return first_id + (ids.empty() ? primitive : ids[primitive]); }
    uint32_t normal(uint32_t vertex) const { return normals.empty() ? RP_NONE : normals[vertex]; }
    uint32_t color(uint32_t vertex) const { return colors.empty() ? RP_NONE : colors[vertex]; }
    Float2 uv(uint32_t vertex) const { return vertex < uvs.size() ? uvs[vertex] : Float2{}; }
    VertexBits vertex(uint32_t index) const { return {positions[index], normal(index), color(index), uv(index)}; }
    VertexAttributes attributes() const { return {!normals.empty(), !colors.empty(), !uvs.empty()}; }
};

// Centre +- radius, rounded outwards.
Box sphere_bounds(const WorldSphere& sphere);
// Exact bounds of a triangle, safe bounds of a sphere and of an instance.
inline Box4 primitive_bounds(const World& world, uint32_t primitive) {
    Box4 box;
    if (!world.is_triangle(primitive)) {
        const Box bounds = world.is_sphere(primitive) ? sphere_bounds(world.sphere(primitive)) : world.instance(primitive).box;
        box.lower = Float4{bounds.lower[0], bounds.lower[1], bounds.lower[2], 0};
        box.upper = Float4{bounds.upper[0], bounds.upper[1], bounds.upper[2], 0};
        return box;
    }
    for (const uint32_t v : world.primitives[primitive]) {
        const Float3& p = world.positions[v];
        box.grow(Float4{p.x, p.y, p.z, 0});
    }
    return box;
}

// What the cut and the builders move about.
struct PrimitiveRef {
    Box box;
    uint32_t id;      // its number in the world
    uint32_t weight;  // estimated bytes in a block
    // Twice the centre.
    float centroid(int axis) const { return box.lower[axis] + box.upper[axis]; }
    // The same for all axes; the fourth numbers are other members.
    Box4 box4() const {
        Box4 result;
        std::memcpy(&result.lower, box.lower, sizeof result.lower);
        std::memcpy(&result.upper, reinterpret_cast<const char*>(this) + offsetof(PrimitiveRef, box.upper), sizeof result.upper);
        return result;
    }
};
static_assert(sizeof(PrimitiveRef) == 32);
// Of all of them together.
uint64_t weight_of(std::span<const PrimitiveRef> refs);
using PrimitiveRefs = UnwrittenVector<PrimitiveRef>;
// What the cut of a world takes for each primitive, besides the refs at hand (world_cut.hpp): its place in the order, its region, a share of the
// sample, and something for the grid of regions.
inline constexpr uint64_t cut_memory = 16;

// What an instance takes while it is cut into blocks, in bytes: its places in World, and what the cut needs.
inline constexpr uint64_t instance_memory = sizeof(WorldInstance) + sizeof(Triangle) + cut_memory;

// Without its weight. In two pieces, as it is read: what is written in smaller ones is waited for.
inline PrimitiveRef make_ref(const World& world, uint32_t primitive) {
    const Box4 box = primitive_bounds(world, primitive);
    const Float4 first = __builtin_shufflevector(box.lower, box.upper, 0, 1, 2, 4),
                 second = __builtin_shufflevector(box.upper, Float4{std::bit_cast<float>(primitive), 0, 0, 0}, 1, 2, 4, 5);
    return std::bit_cast<PrimitiveRef>(std::array{first, second});
}
// One for each of the primitives, in their order.
void make_refs(const World& world, std::span<const uint32_t> primitives, PrimitiveRefs& refs);

// Gives refs their weights.
class Weigher {
public:
    // Triangles share vertices by index, or have vertices of their own, which are compared.
    enum class Sharing : uint8_t { by_index, by_value };
    Weigher(const World& world, Sharing sharing);
    // Of refs that lie together.
    void weigh(std::span<PrimitiveRef> refs) const;
    // Of any refs: by index the same, else rather too low.
    void guess(std::span<PrimitiveRef> refs) const;

private:
    void weigh_by_index(std::span<PrimitiveRef> refs) const;
    void weigh_by_value(std::span<PrimitiveRef> refs) const;

    const World& world_;
    const Sharing sharing_;
    std::vector<uint8_t> uses_;  // by index: how many triangles use each vertex, at most 255
};

// The estimate itself, for a triangle that has this many vertices for itself: a half in a closed mesh, three if it stands alone.
inline constexpr uint32_t sphere_weight = 16 + 4 + 6;                      // record, id, share of nodes
inline constexpr uint32_t instance_weight = sizeof(rp_instance) + 4 + 32;  // record, number, node: each is a leaf
uint32_t triangle_weight(float own_vertices, const VertexAttributes& attributes);

}  // namespace raypager
