#include "bench/ray_sets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "scene/projection.hpp"

namespace raypager::bench {
namespace {

Float3 operator+(const Float3& a, const Float3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Float3 operator-(const Float3& a, const Float3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Float3 operator*(float s, const Float3& a) { return {s * a.x, s * a.y, s * a.z}; }
float dot(const Float3& a, const Float3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Float3 cross(const Float3& a, const Float3& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Float3 normalized(const Float3& a) { return (1 / std::sqrt(dot(a, a))) * a; }

// Off the surface, on the side that the ray came from, by more than the position can be wrong.
Float3 leave_surface(const Ray& ray, const SurfacePoint& hit, Float3& normal) {
    normal = dot(hit.normal, ray.direction) > 0 ? -1.0f * hit.normal : hit.normal;
    const float largest = std::max({std::abs(hit.position.x), std::abs(hit.position.y), std::abs(hit.position.z)});
    return hit.position + (largest * 4e-6f) * normal;
}

// A random point between two corners.
template <typename Random>
Float3 point_between(const Float3& corner_low, const Float3& corner_high, Random& random) {
    std::uniform_real_distribution<float> uniform(0, 1);
    const Float3 along = corner_high - corner_low;
    const float a = uniform(random), b = uniform(random), c = uniform(random);
    return corner_low + Float3{a * along.x, b * along.y, c * along.z};
}

}  // namespace

std::vector<Ray> primary_rays(const Camera& camera, uint32_t width, uint32_t height) {
    constexpr uint32_t tile = 8;
    std::vector<Ray> rays;
    rays.reserve(size_t{width} * height);
    for (uint32_t top = 0; top < height; top += tile)
        for (uint32_t left = 0; left < width; left += tile)
            for (uint32_t y = top; y < std::min(top + tile, height); y++)
                for (uint32_t x = left; x < std::min(left + tile, width); x++) {
                    if (camera.projection != Projection::perspective) {
                        const ViewRay ray = view_ray(camera, (x + 0.5) / width, (y + 0.5) / height);
                        rays.push_back({float3(ray.origin), std::numeric_limits<float>::infinity(), float3(ray.direction)});
                        continue;
                    }
                    const float u = 2 * (static_cast<float>(x) + 0.5f) / static_cast<float>(width) - 1;
                    const float v = 1 - 2 * (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
                    rays.push_back(
                        {camera.eye, std::numeric_limits<float>::infinity(), normalized(camera.forward + u * camera.right + v * camera.up)});
                }
    return rays;
}

void end_at_ceiling(std::vector<Ray>& rays, std::vector<SurfacePoint>& hits, const Float3& corner_low, const Float3& corner_high, uint32_t seed) {
    std::mt19937 random(seed);
    for (size_t i = 0; i < rays.size(); i++) {
        if (hits[i].hit) continue;
        hits[i].hit = true;
        hits[i].position = point_between(corner_low, corner_high, random);
        hits[i].normal = {0, -1, 0};
        rays[i].direction = {0, 1, 0};
    }
}

std::vector<Ray> diffuse_rays(const std::vector<Ray>& rays, const std::vector<SurfacePoint>& hits, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    std::vector<Ray> result;
    result.reserve(rays.size());
    for (size_t i = 0; i < rays.size(); i++) {
        if (!hits[i].hit) continue;
        Float3 n;
        const Float3 origin = leave_surface(rays[i], hits[i], n);
        const float radius2 = uniform(random), angle = 2 * std::numbers::pi_v<float> * uniform(random), radius = std::sqrt(radius2);
        const Float3 side = std::abs(n.x) > 0.5f ? Float3{0, 1, 0} : Float3{1, 0, 0};
        const Float3 t = normalized(cross(n, side)), b = cross(n, t);
        const Float3 direction = (radius * std::cos(angle)) * t + (radius * std::sin(angle)) * b + std::sqrt(std::max(0.0f, 1 - radius2)) * n;
        result.push_back({origin, std::numeric_limits<float>::infinity(), normalized(direction)});
    }
    return result;
}

std::vector<Ray> shadow_rays(const std::vector<Ray>& rays, const std::vector<SurfacePoint>& hits, const Float3& corner_low, const Float3& corner_high,
                             uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<Ray> result;
    result.reserve(rays.size());
    for (size_t i = 0; i < rays.size(); i++) {
        if (!hits[i].hit) continue;
        Float3 n;
        const Float3 origin = leave_surface(rays[i], hits[i], n);
        const Float3 way = point_between(corner_low, corner_high, random) - origin;
        const float distance = std::sqrt(dot(way, way));
        if (distance > 0) result.push_back({origin, distance, (1 / distance) * way});
    }
    return result;
}

}  // namespace raypager::bench
