#include "world/world.hpp"

#include <cmath>

#include "base/next_float.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

// Estimates for the bytes of a primitive in a block. A triangle of a closed mesh has half a vertex for itself, an isolated one three;
// the fewer neighbours it has, the fewer triangles it will share a leaf with. Too low an estimate costs a second build. So ids, and positions, are
// taken for whole: how many bits they will take is known only when the block is there.
constexpr float single_leaf_bytes = 56;  // of a leaf with a single triangle: leaf, ids, and one node a leaf

std::vector<uint8_t> count_uses(const World& world) {
    std::vector<uint8_t> uses(world.positions.size());
    if (uses.empty()) return uses;
    for (uint32_t i = 0; i < world.primitives.size(); i++) {
        if (!world.is_triangle(i)) continue;
        for (uint32_t v : world.primitives[i]) uses[v] += uses[v] < 255;
    }
    return uses;
}

// A vertex that n triangles share is an nth of one to each.
float own_vertices(const Triangle& vertices, std::span<const uint8_t> uses) {
    float sum = 0;
    for (const uint32_t v : vertices) sum += 1.0f / uses[v];
    return sum;
}

uint32_t weight_without_vertices(const World& world, uint32_t primitive) { return world.is_sphere(primitive) ? sphere_weight : instance_weight; }

}  // namespace

uint64_t weight_of(std::span<const PrimitiveRef> refs) {
    uint64_t sum = 0;
    for (const PrimitiveRef& ref : refs) sum += ref.weight;
    return sum;
}

uint32_t triangle_weight(float own_vertices, const VertexAttributes& attributes) {
    const float vertex_bytes = static_cast<float>(attributes.vertex_bytes()) * 1.15f;
    return static_cast<uint32_t>(std::ceil(own_vertices * vertex_bytes + std::min(single_leaf_bytes, 7 + 17 * own_vertices)));
}

Box sphere_bounds(const WorldSphere& sphere) {
    const float center[3] = {sphere.center.x, sphere.center.y, sphere.center.z};
    Box box;
    for (int a = 0; a < 3; a++) {
        const double c = center[a], r = sphere.radius;
        box.lower[a] = next_below(static_cast<float>(c - r));
        box.upper[a] = next_above(static_cast<float>(c + r));
    }
    return box;
}

void make_refs(const World& world, std::span<const uint32_t> primitives, PrimitiveRefs& refs) {
    refs.resize(primitives.size());
    for (size_t i = 0; i < refs.size(); i++) refs[i] = make_ref(world, primitives[i]);
}

Weigher::Weigher(const World& world, Sharing sharing) : world_(world), sharing_(sharing) {
    if (sharing == Sharing::by_index) uses_ = count_uses(world);
}

void Weigher::weigh(std::span<PrimitiveRef> refs) const { sharing_ == Sharing::by_index ? weigh_by_index(refs) : weigh_by_value(refs); }

void Weigher::guess(std::span<PrimitiveRef> refs) const {
    if (sharing_ == Sharing::by_index) return weigh_by_index(refs);
    const uint32_t weight = triangle_weight(0.5f, world_.attributes());
    for (PrimitiveRef& ref : refs) ref.weight = world_.is_triangle(ref.id) ? weight : weight_without_vertices(world_, ref.id);
}

void Weigher::weigh_by_index(std::span<PrimitiveRef> refs) const {
    for (PrimitiveRef& ref : refs) {
        ref.weight = world_.is_triangle(ref.id) ? triangle_weight(own_vertices(world_.primitives[ref.id], uses_), world_.attributes())
                                                : weight_without_vertices(world_, ref.id);
    }
}

void Weigher::weigh_by_value(std::span<PrimitiveRef> refs) const {
    VertexTable table(refs.size());
    std::vector<uint8_t> uses;
    std::vector<Triangle> numbers(refs.size());
    for (size_t i = 0; i < refs.size(); i++) {
        if (!world_.is_triangle(refs[i].id)) continue;
        for (int k = 0; k < 3; k++) {
            const uint32_t v = numbers[i][k] = table.number(world_.vertex(world_.primitives[refs[i].id][k]));
            if (v == uses.size()) uses.push_back(0);
            uses[v] += uses[v] < 255;
        }
    }
    for (size_t i = 0; i < refs.size(); i++) {
        const bool is_triangle = world_.is_triangle(refs[i].id);
        refs[i].weight =
            is_triangle ? triangle_weight(own_vertices(numbers[i], uses), world_.attributes()) : weight_without_vertices(world_, refs[i].id);
    }
}

}  // namespace raypager
