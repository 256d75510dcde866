#include "reference/rays.hpp"

#include "base/check.hpp"
#include "reference/bsdf.hpp"

namespace raypager::reference {
namespace {

class RayMaker {
public:
    RayMaker(const ReferenceGeometry& geometry, uint64_t seed) : geometry_(geometry), random_(seed) {
        RAYPAGER_CHECK(geometry.lower().x <= geometry.upper().x);
        center_ = (geometry.lower() + geometry.upper()) / 2;
        extent_ = geometry.upper() - geometry.lower();
        size_ = std::max(length(extent_), 1e-30);
    }

    Ray make(RayKind kind) {
        Ray ray = without_end(kind);
        if (random_.uniform() < 0.25) ray.tmax = static_cast<float>(random_.uniform() * size_ / length(Vec3(ray.direction)));
        return ray;
    }

private:
    Ray without_end(RayKind kind) {
        switch (kind) {
            case RayKind::random:
                return towards(outside_point(), bounds_point(1));
            case RayKind::edges:
                return through(edge_point());
            case RayKind::vertices:
                return through(vertex());
            case RayKind::axis_parallel:
                return axis_parallel();
            case RayKind::in_plane:
                return in_plane();
            case RayKind::on_surface:
                break;
        }
        return {surface_point(), (uniform_direction() * any_length()).to_float()};
    }

    double between(double low, double high) { return low + (high - low) * random_.uniform(); }
    double any_length() { return std::exp2(between(-8, 8)); }
    Vec3 uniform_direction() {
        const double u = random_.uniform(), v = random_.uniform();
        return uniform_sphere(u, v);
    }
    Vec3 bounds_point(double enlarge) {
        const double x = between(-0.5, 0.5), y = between(-0.5, 0.5), z = between(-0.5, 0.5);
        return center_ + enlarge * Vec3(x * extent_.x, y * extent_.y, z * extent_.z);
    }
    Vec3 outside_point() { return random_.uniform() < 0.5 ? bounds_point(1.5) : center_ + uniform_direction() * size_ * between(0.6, 3); }

    uint32_t primitive() {
        for (;;) {
            const auto id = static_cast<uint32_t>(random_.uniform() * geometry_.primitive_count());
            if (!geometry_.is_degenerate(id)) return id;
        }
    }
    Vec3 sphere_point(uint32_t id) {
        const WorldSphere& sphere = geometry_.sphere(id);
        return Vec3(sphere.center) + double{sphere.radius} * uniform_direction();
    }
    Float3 vertex() {
        const uint32_t id = primitive();
        return (geometry_.is_sphere(id) ? sphere_point(id) : geometry_.corners(id)[static_cast<size_t>(random_.uniform() * 3)]).to_float();
    }
    Float3 edge_point() {
        const uint32_t id = primitive();
        if (geometry_.is_sphere(id)) return sphere_point(id).to_float();
        const Corners p = geometry_.corners(id);
        const auto i = static_cast<size_t>(random_.uniform() * 3);
        const double s = random_.uniform() < 0.5 ? 0.5 : random_.uniform();
        return (p[i] + s * (p[(i + 1) % 3] - p[i])).to_float();
    }
    Float3 surface_point() {
        const uint32_t id = primitive();
        if (geometry_.is_sphere(id)) return sphere_point(id).to_float();
        const Corners p = geometry_.corners(id);
        const double root = std::sqrt(random_.uniform()), v = random_.uniform();
        return (p[0] * (1 - root) + p[1] * (root * (1 - v)) + p[2] * (root * v)).to_float();
    }

    Ray towards(const Vec3& from, const Vec3& to) { return {from.to_float(), ((to - from) * any_length()).to_float()}; }

    // Half of the rays have directions of few bits, and start a power of two before the target: where no bit is lost on the way, the
    // ray meets it exactly.
    Ray through(const Float3& target) {
        if (random_.uniform() < 0.5) return towards(outside_point(), Vec3(target));
        const Vec3 wish = uniform_direction() * 16;
        const Vec3 direction(std::nearbyint(wish.x), std::nearbyint(wish.y), std::nearbyint(wish.z));
        const double step = std::exp2(std::floor(std::log2(size_)) - 4);
        return {(Vec3(target) - direction * step).to_float(), (direction * step).to_float()};
    }

    Ray axis_parallel() {
        const double choice = random_.uniform();
        const Float3 target = choice < 0.3 ? vertex() : choice < 0.6 ? edge_point() : surface_point();
        const int axis = static_cast<int>(random_.uniform() * 3);
        const auto distance = static_cast<float>(between(0, 1.5) * size_);
        const auto step = static_cast<float>((random_.uniform() < 0.5 ? -1 : 1) * any_length());
        const float zero = random_.uniform() < 0.5 ? 0.0f : -0.0f;
        Ray ray{target, {zero, zero, zero}};
        float* const origins[] = {&ray.origin.x, &ray.origin.y, &ray.origin.z};
        float* const directions[] = {&ray.direction.x, &ray.direction.y, &ray.direction.z};
        *origins[axis] -= std::copysign(distance, step);
        *directions[axis] = step;
        return ray;
    }

    Ray in_plane() {
        uint32_t id = primitive();
        for (int tries = 0; geometry_.is_sphere(id) && tries < 100; tries++) id = primitive();
        if (geometry_.is_sphere(id)) return through(vertex());
        const Corners p = geometry_.corners(id);
        const double a = between(-1, 2), b = between(-1, 2), c = between(0, 1), d = between(0, 1 - c);
        const Vec3 from = p[0] + a * (p[1] - p[0]) + b * (p[2] - p[0]), to = p[0] + c * (p[1] - p[0]) + d * (p[2] - p[0]);
        return towards(from, to);
    }

    const ReferenceGeometry& geometry_;
    Random random_;
    Vec3 center_, extent_;
    double size_ = 1;
};

}  // namespace

const char* name(RayKind kind) {
    constexpr const char* names[] = {"random", "edges", "vertices", "axis_parallel", "in_plane", "on_surface"};
    return names[static_cast<size_t>(kind)];
}

std::vector<Ray> make_rays(const ReferenceGeometry& geometry, RayKind kind, size_t count, uint64_t seed) {
    RayMaker maker(geometry, seed);
    std::vector<Ray> rays;
    rays.reserve(count);
    while (rays.size() < count) {
        const Ray ray = maker.make(kind);
        if (ray.direction != Float3{}) rays.push_back(ray);
    }
    return rays;
}

}  // namespace raypager::reference
