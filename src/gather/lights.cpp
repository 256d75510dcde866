#include "gather/lights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "world/placement.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

// Each copy of a mesh makes lights of its own, so a small file could ask for any number of them.
constexpr size_t max_unseen_lights = size_t{1} << 22;

double luminance(const float (&rgb)[3]) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

// In watts, for radiance in W/(m^2 sr).
double power(const rp_light& light, double scene_radius) {
    const double y = luminance(light.radiance), disk = pi * scene_radius * scene_radius;
    switch (light.kind) {
        case RP_LIGHT_TRIANGLE:
        case RP_LIGHT_SPHERE:
            return pi * y * light.area * (light.flags & RP_LIGHT_TWO_SIDED ? 2 : 1);
        case RP_LIGHT_INFINITE:
            return 4 * pi * disk * y;
        case RP_LIGHT_DISTANT:
            return disk * y;
        default:
            return 4 * pi * y;
    }
}

}  // namespace

rp_light sphere_light(const WorldSphere& sphere, const AreaLight& light) { return sphere_light(sphere.center, sphere.radius, light); }

bool is_black(const AreaLight& light) { return light.radiance.x == 0 && light.radiance.y == 0 && light.radiance.z == 0; }

double radius_of(const float (&lower)[3], const float (&upper)[3]) {
    return 0.5 * std::hypot(double(upper[0]) - lower[0], double(upper[1]) - lower[1], double(upper[2]) - lower[2]);
}

rp_light primitive_light(const World& world, uint32_t primitive, const AreaLight& light) {
    if (world.is_sphere(primitive)) return sphere_light(world.sphere(primitive), light);
    const Triangle& t = world.primitives[primitive];
    return triangle_light(world.positions[t[0]], world.positions[t[1]], world.positions[t[2]], light);
}

namespace {

// Makes lights of triangles as they come.
class UnseenMesh final : public MeshSink {
public:
    UnseenMesh(const Shape& shape, const AreaLight& light, std::vector<rp_light>& lights, MeshIssues& issues)
        : shape_(shape), placement_(shape, 0), light_(light), lights_(lights), issues_(issues) {}

    Status vertices(const MeshVertices& vertices) override {
        for (const Float3& p : vertices.positions) positions_.push_back(placement_.point(p));
        return {};
    }

    Status triangles(std::span<const Triangle> indices) override {
        for (const auto& [a, b, c] : indices) {
            if (std::max({a, b, c}) >= positions_.size())
                issues_.bad_index++;
            else
                RAYPAGER_TRY(add(a, placement_.flips() ? c : b, placement_.flips() ? b : c));
        }
        return {};
    }

private:
    Status add(uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t v : {a, b, c}) {
            const Float3& p = positions_[v];
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return issues_.not_finite++, Status();
            if (!in_range(p)) return out_of_range(shape_, v, p);
        }
        const rp_light light = triangle_light(positions_[a], positions_[b], positions_[c], light_);
        if (!(light.area > 0) || has_no_area(positions_[a], positions_[b], positions_[c])) return issues_.degenerate++, Status();
        if (lights_.size() >= max_unseen_lights)
            return Status::failed(
                fmt::format("{}: more than {} lights that are not seen; give this one a coarser mesh", shape_.name, max_unseen_lights));
        lights_.push_back(unseen(light));
        return {};
    }

    const Shape& shape_;
    const PlacedShape placement_;
    const AreaLight& light_;
    std::vector<rp_light>& lights_;
    MeshIssues& issues_;
    std::vector<Float3> positions_;  // in the world
};

}  // namespace

Status add_unseen_lights(const Shape& shape, const AreaLight& light, std::vector<rp_light>& lights, MeshIssues& issues) {
    if (shape.mesh) {
        UnseenMesh sink(shape, light, lights, issues);
        return shape.mesh->stream(sink, issues);
    }
    const auto sphere = place_sphere(shape);
    if (!sphere) return sphere.status();
    if (*sphere)
        lights.push_back(unseen(sphere_light(**sphere, light)));
    else
        issues.degenerate++;
    return {};
}

// Half by power, half evenly over groups (all emitters with a surface are one, every other light is one of its own) and by power within
// them. Power alone fails where the scene is wide: it gives a sky nearly all samples, though those that the BSDF draws serve it best,
// and leaves the lamp that lights the picture next to none.
void set_probabilities(std::vector<rp_light>& lights, double scene_radius) {
    constexpr double floor = 1e-6;  // of the whole, shared evenly
    constexpr double by_power = 0.5;
    const auto has_surface = [](const rp_light& light) { return light.kind == RP_LIGHT_TRIANGLE || light.kind == RP_LIGHT_SPHERE; };
    double total = 0, surfaces = 0;
    size_t groups = 0;
    for (const rp_light& light : lights) {
        const double watts = power(light, scene_radius);
        total += watts;
        if (has_surface(light))
            surfaces += watts;
        else
            groups += watts > 0;
    }
    groups += surfaces > 0;
    const double even = 1.0 / static_cast<double>(std::max<size_t>(1, lights.size()));
    for (rp_light& light : lights) {
        double share = even;
        if (total > 0 && std::isfinite(total)) {
            const double watts = power(light, scene_radius);
            const double in_group = watts > 0 ? (has_surface(light) ? watts / surfaces : 1.0) / static_cast<double>(groups) : 0.0;
            share = by_power * watts / total + (1 - by_power) * in_group;
        }
        light.probability = static_cast<float>((1 - floor) * share + floor * even);
    }
}

}  // namespace raypager
