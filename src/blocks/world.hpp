// All primitives of a scene, in world space, as the cut and the builders of blocks see them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/huge_pages.hpp"
#include "blocks/box.hpp"
#include "blocks/vertex_table.hpp"
#include "raypager/abi/types.h"
#include "raypager/scene.hpp"

namespace raypager {

struct WorldSphere {
    Float3 center;
    float radius;                   // of a point: exactly what its word says
    uint32_t point_word = RP_NONE;  // of a point of a coloured cloud (abi/block.h; RP_NONE is none, for it has code 255); a sphere: RP_NONE
    bool is_point() const { return point_word != RP_NONE; }
};

struct World {
    std::vector<Float3> positions;
    std::vector<uint32_t> normals;  // octahedral, one a position, RP_NONE where there is none; empty: no shape has any
    // A triangle: its vertices, counter-clockwise seen from the side of its normal.
    // A sphere: its index among the spheres, then RP_NONE twice.
    std::vector<Triangle> primitives;
    std::vector<WorldSphere> spheres;
    // Of the primitives, in the scene, where these are only some of the scene's; empty: primitive i has the id i.
    std::vector<uint32_t> ids;
    Box bounds;

    bool is_sphere(uint32_t primitive) const { return primitives[primitive][1] == RP_NONE; }
    const WorldSphere& sphere(uint32_t primitive) const { return spheres[primitives[primitive][0]]; }
    uint32_t id(uint32_t primitive) const { return ids.empty() ? primitive : ids[primitive]; }
    uint32_t normal(uint32_t vertex) const { return normals.empty() ? RP_NONE : normals[vertex]; }
    VertexBits vertex(uint32_t index) const { return {positions[index], normal(index)}; }
};

// Centre +- radius, rounded outwards.
Box sphere_bounds(const WorldSphere& sphere);
// Exact bounds of a triangle, safe bounds of a sphere.
Box primitive_bounds(const World& world, uint32_t primitive);

// What the cut and the builders move about.
struct PrimitiveRef {
    Box box;
    uint32_t id;      // its number in the world
    uint32_t weight;  // estimated bytes in a block
    // Twice the centre.
    float centroid(int axis) const { return box.lower[axis] + box.upper[axis]; }
    // The same for all axes; the fourth lanes hold other members.
    LaneBox lanes() const {
        LaneBox result;
        std::memcpy(&result.lower, box.lower, sizeof result.lower);
        std::memcpy(&result.upper, reinterpret_cast<const char*>(this) + offsetof(PrimitiveRef, box.upper), sizeof result.upper);
        return result;
    }
};
static_assert(sizeof(PrimitiveRef) == 32);
using PrimitiveRefs = UnwrittenVector<PrimitiveRef>;

// One for each primitive, in order. Weights follow from how many triangles share the vertices by index.
PrimitiveRefs make_refs(const World& world);
// The same for a world whose triangles have vertices of their own: weights are a guess, until weigh() compares the vertices of a
// part of the refs that lie together.
PrimitiveRefs make_unweighed_refs(const World& world);
void weigh(const World& world, std::span<PrimitiveRef> refs);
// The estimate itself, for a triangle that has this many vertices for itself: a half in a closed mesh, three if it stands alone.
inline constexpr uint32_t sphere_weight = 16 + 4 + 6;  // record, id, share of nodes
uint32_t triangle_weight(float own_vertices, bool with_normals);

}  // namespace raypager
