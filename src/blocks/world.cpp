#include "blocks/world.hpp"

#include <cmath>

#include "base/parallel.hpp"

namespace raypager {
namespace {

// Estimates for the bytes of a primitive in a block. A triangle of a closed mesh has half a vertex for itself, an isolated one three;
// the fewer neighbours it has, the fewer triangles it will share a leaf with. Too low an estimate costs a second build. So ids, and positions, are
// taken for whole: how many bits they will take is known only when the block is there.
constexpr float single_leaf_bytes = 56;  // of a leaf with a single triangle: leaf, ids, and one node a leaf

// How many triangles use each vertex, at most 255.
std::vector<uint8_t> count_uses(const World& world) {
    std::vector<uint8_t> uses(world.positions.size());
    for (uint32_t i = 0; i < world.primitives.size(); i++) {
        if (world.is_sphere(i)) continue;
        for (uint32_t v : world.primitives[i]) uses[v] += uses[v] < 255;
    }
    return uses;
}

}  // namespace

uint32_t triangle_weight(float own_vertices, bool with_normals) {
    const float vertex_bytes = (with_normals ? 16.0f : 12.0f) * 1.15f;
    return static_cast<uint32_t>(std::ceil(own_vertices * vertex_bytes + std::min(single_leaf_bytes, 7 + 17 * own_vertices)));
}

Box sphere_bounds(const WorldSphere& sphere) {
    const float center[3] = {sphere.center.x, sphere.center.y, sphere.center.z};
    Box box;
    for (int a = 0; a < 3; a++) {
        const double c = center[a], r = sphere.radius;
        box.lower[a] = std::nextafter(static_cast<float>(c - r), -INFINITY);
        box.upper[a] = std::nextafter(static_cast<float>(c + r), INFINITY);
    }
    return box;
}

Box primitive_bounds(const World& world, uint32_t primitive) {
    if (world.is_sphere(primitive)) return sphere_bounds(world.sphere(primitive));
    Box box;
    for (uint32_t v : world.primitives[primitive]) box.grow(world.positions[v]);
    return box;
}

PrimitiveRefs make_refs(const World& world) {
    const std::vector<uint8_t> uses = count_uses(world);
    PrimitiveRefs refs(world.primitives.size());
    parallel_for(refs.size(), size_t{1} << 16, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const auto id = static_cast<uint32_t>(i);
            uint32_t weight = sphere_weight;
            if (!world.is_sphere(id)) {
                float own_vertices = 0;
                for (uint32_t v : world.primitives[id]) own_vertices += 1.0f / uses[v];
                weight = triangle_weight(own_vertices, !world.normals.empty());
            }
            refs[i] = {primitive_bounds(world, id), id, weight};
        }
    });
    return refs;
}

PrimitiveRefs make_unweighed_refs(const World& world) {
    // Rather too low: a part that is cut too small at first stays too small.
    const uint32_t guess = triangle_weight(0.5f, !world.normals.empty());
    PrimitiveRefs refs(world.primitives.size());
    parallel_for(refs.size(), size_t{1} << 16, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const auto id = static_cast<uint32_t>(i);
            refs[i] = {primitive_bounds(world, id), id, world.is_sphere(id) ? sphere_weight : guess};
        }
    });
    return refs;
}

void weigh(const World& world, std::span<PrimitiveRef> refs) {
    VertexTable table(refs.size());
    std::vector<uint8_t> uses;
    std::vector<Triangle> numbers(refs.size());
    for (size_t i = 0; i < refs.size(); i++) {
        if (world.is_sphere(refs[i].id)) continue;
        for (int k = 0; k < 3; k++) {
            const uint32_t v = numbers[i][k] = table.number(world.vertex(world.primitives[refs[i].id][k]));
            if (v == uses.size()) uses.push_back(0);
            uses[v] += uses[v] < 255;
        }
    }
    for (size_t i = 0; i < refs.size(); i++) {
        if (world.is_sphere(refs[i].id)) continue;
        float own_vertices = 0;
        for (const uint32_t v : numbers[i]) own_vertices += 1.0f / uses[v];
        refs[i].weight = triangle_weight(own_vertices, !world.normals.empty());
    }
}

}  // namespace raypager
