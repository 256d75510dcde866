#include "procedural/limbs.hpp"

#include <algorithm>

#include "procedural/parts.hpp"

namespace raypager {

uint32_t put_vertex(TriangleMesh& mesh, const Vector& p) {
    mesh.positions.push_back(float3(p));
    return static_cast<uint32_t>(mesh.positions.size() - 1);
}

Vector heading(double turns) {
    const SinCos angle = sincos_turns(turns);
    return {angle.cos, 0, angle.sin};
}

Vector Limb::at(double share) const {
    const double place = share * static_cast<double>(path.size() - 1);
    const size_t i = std::min(static_cast<size_t>(place), path.size() - 2);
    const double rest = place - static_cast<double>(i);
    return path[i] * (1 - rest) + path[i + 1] * rest;
}

Vector Limb::direction(double share) const {
    const size_t i = std::min(static_cast<size_t>(share * static_cast<double>(path.size() - 1)), path.size() - 2);
    return unit(path[i + 1] - path[i]);
}

Limb grow_limb(const Vector& from, Vector direction, double length, double radius, double rise, size_t steps, Random& random) {
    Limb limb{{from}, radius, length};
    const double step = 1.0 / static_cast<double>(steps);
    for (size_t i = 0; i < steps; i++) {
        direction = unit(direction + upwards * (rise * step) + random.direction() * (0.35 * step));
        limb.path.push_back(limb.path.back() + direction * (length * step));
    }
    return limb;
}

void add_limb(TriangleMesh& mesh, const Limb& limb, uint32_t sides, double taper) {
    const size_t n = limb.path.size();
    Pose pose = Pose::along(limb.path[0], limb.direction(0));
    std::vector<uint32_t> before, ring(sides);
    for (size_t i = 0; i < n; i++) {
        const Vector tangent = unit(limb.path[std::min(i + 1, n - 1)] - limb.path[i > 0 ? i - 1 : 0]);
        pose.x = unit(pose.x - tangent * dot(pose.x, tangent));  // carried along with as little twist as possible
        pose.z = cross(pose.x, tangent);
        const double radius = limb.radius * (1 - taper * static_cast<double>(i) / static_cast<double>(n - 1));
        const bool last = i + 1 == n;
        for (uint32_t j = 0; j < sides; j++) {
            const Vector around = heading(static_cast<double>(j) / sides);
            ring[j] =
                last && j > 0 ? ring[0] : put_vertex(mesh, limb.path[i] + (last ? Vector{} : (pose.x * around[0] + pose.z * around[2]) * radius));
        }
        for (uint32_t j = 0; j < sides && i > 0; j++) {
            const uint32_t k = (j + 1) % sides;
            mesh.triangles.push_back({before[j], ring[j], before[k]});
            if (!last) mesh.triangles.push_back({before[k], ring[j], ring[k]});
        }
        before = ring;
    }
}

}  // namespace raypager
