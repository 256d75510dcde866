#include "procedural/island_strand.hpp"

#include <algorithm>
#include <cmath>

#include "procedural/limbs.hpp"

namespace raypager {
namespace {

// How finely each of some limbs is made, of so many triangles together.
struct LimbSteps {
    uint32_t sides;
    size_t steps;
    LimbSteps(uint64_t triangles, uint64_t limbs) {
        const uint64_t each = triangles / limbs;
        sides = static_cast<uint32_t>(std::clamp(std::sqrt(static_cast<double>(each) / 3), 3.0, 24.0));
        steps = std::max<size_t>(2, (each / sides + 1) / 2);
    }
};

}  // namespace

TriangleMesh make_shell(uint64_t triangles, Random& random) {
    TriangleMesh mesh;
    const auto sides = static_cast<uint32_t>(std::clamp(std::sqrt(static_cast<double>(triangles) / 10), 3.0, 32.0));
    const uint64_t steps = std::max<uint64_t>(4, triangles / (2 * sides));
    const double turns = random.uniform(2.6, 4.2), slender = random.uniform(0.6, 1.6);
    for (uint64_t i = 0; i <= steps; i++) {
        const double t = 0.15 + 0.85 * static_cast<double>(i) / static_cast<double>(steps), size = t * t;
        const SinCos at = sincos_turns(turns * t);
        const Vector out = {0, at.cos, at.sin};
        const Vector middle = out * (0.27 * size) + Vector{slender * (0.5 - size), 0, 0};
        for (uint32_t j = 0; j < sides; j++) {
            const SinCos around = sincos_turns(static_cast<double>(j) / sides);
            put_vertex(mesh, middle + (out * around.cos + Vector{around.sin, 0, 0}) * (0.25 * size));
        }
        for (uint32_t j = 0; j < sides && i > 0; j++) {
            const auto a = static_cast<uint32_t>((i - 1) * sides + j), b = static_cast<uint32_t>((i - 1) * sides + (j + 1) % sides);
            mesh.triangles.push_back({a, b, a + sides});
            mesh.triangles.push_back({b, b + sides, a + sides});
        }
    }
    return mesh;
}

TriangleMesh make_coral(uint64_t triangles, Random& random) {
    TriangleMesh mesh;
    const uint64_t branches = std::clamp<uint64_t>(triangles / 12, 2, 14);
    const LimbSteps grid(triangles, branches);
    for (uint64_t i = 0; i < branches; i++) {
        const Vector out = unit(random.direction() + upwards * 0.8);
        const double radius = random.uniform(0.05, 0.1), length = random.uniform(0.35, 0.65);
        add_limb(mesh, grow_limb({0, -0.1, 0}, out, length, radius, 0.4, grid.steps, random), grid.sides, 0.4);
    }
    return mesh;
}

TriangleMesh make_driftwood(uint64_t triangles, Random& random) {
    TriangleMesh mesh;
    const LimbSteps grid(triangles, 3);
    const Limb trunk = grow_limb({-0.5, 0.02, 0}, {1, 0, 0}, 1, random.uniform(0.04, 0.08), 0, grid.steps, random);
    add_limb(mesh, trunk, grid.sides, 0.6);
    for (const double share : {0.3, 0.65}) {
        const Vector out = unit(Vector{0.7, random.uniform(0, 0.8), random.uniform(-1, 1)});
        add_limb(mesh, grow_limb(trunk.at(share), out, random.uniform(0.15, 0.35), 0.5 * trunk.radius, 0, grid.steps, random), grid.sides);
    }
    return mesh;
}

}  // namespace raypager
