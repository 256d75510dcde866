#include "blocks/lights.hpp"

#include <cmath>
#include <numbers>

namespace raypager {
namespace {

using std::numbers::pi;

void store(float (&out)[3], const Float3& value) {
    out[0] = value.x;
    out[1] = value.y;
    out[2] = value.z;
}

double luminance(const float (&rgb)[3]) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

double triangle_area(const Float3& a, const Float3& b, const Float3& c) {
    const double ux = double(b.x) - a.x, uy = double(b.y) - a.y, uz = double(b.z) - a.z;
    const double vx = double(c.x) - a.x, vy = double(c.y) - a.y, vz = double(c.z) - a.z;
    return 0.5 * std::sqrt(std::pow(uy * vz - uz * vy, 2) + std::pow(uz * vx - ux * vz, 2) + std::pow(ux * vy - uy * vx, 2));
}

rp_light emitter(uint32_t kind, const AreaLight& light) {
    rp_light result = {};
    result.kind = kind;
    result.flags = light.two_sided ? RP_LIGHT_TWO_SIDED : 0;
    store(result.radiance, light.radiance);
    return result;
}

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

rp_light triangle_light(const Float3& a, const Float3& b, const Float3& c, const AreaLight& light) {
    rp_light result = emitter(RP_LIGHT_TRIANGLE, light);
    store(result.p, a);
    store(result.e1, {b.x - a.x, b.y - a.y, b.z - a.z});
    store(result.e2, {c.x - a.x, c.y - a.y, c.z - a.z});
    result.area = static_cast<float>(triangle_area(a, b, c));
    return result;
}

bool is_black(const AreaLight& light) { return light.radiance.x == 0 && light.radiance.y == 0 && light.radiance.z == 0; }

rp_light shining_as(const rp_light& light, const AreaLight& area) {
    rp_light result = light;
    const rp_light shine = emitter(light.kind, area);
    result.flags = shine.flags;
    store(result.radiance, area.radiance);
    result.probability = 0;
    return result;
}

double radius_of(const float (&lower)[3], const float (&upper)[3]) {
    return 0.5 * std::hypot(double(upper[0]) - lower[0], double(upper[1]) - lower[1], double(upper[2]) - lower[2]);
}

rp_light sphere_light(const WorldSphere& sphere, const AreaLight& light) {
    rp_light result = emitter(RP_LIGHT_SPHERE, light);
    store(result.p, sphere.center);
    result.e1[0] = sphere.radius;
    result.area = static_cast<float>(4 * pi * double(sphere.radius) * sphere.radius);
    return result;
}

rp_light primitive_light(const World& world, uint32_t primitive, const AreaLight& light) {
    if (world.is_sphere(primitive)) return sphere_light(world.sphere(primitive), light);
    const Triangle& t = world.primitives[primitive];
    return triangle_light(world.positions[t[0]], world.positions[t[1]], world.positions[t[2]], light);
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
