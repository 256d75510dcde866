#include "scene/emitters.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace raypager {
namespace {

void store(float (&out)[3], const Float3& value) {
    out[0] = value.x;
    out[1] = value.y;
    out[2] = value.z;
}

double triangle_area(const Float3& a, const Float3& b, const Float3& c) {
    const double ux = double(b.x) - a.x, uy = double(b.y) - a.y, uz = double(b.z) - a.z;
    const double vx = double(c.x) - a.x, vy = double(c.y) - a.y, vz = double(c.z) - a.z;
    return 0.5 * std::sqrt(std::pow(uy * vz - uz * vy, 2) + std::pow(uz * vx - ux * vz, 2) + std::pow(ux * vy - uy * vx, 2));
}

rp_light emitter(uint32_t kind, const AreaLight& light, double area) {
    rp_light result = {};
    result.kind = kind;
    result.area = static_cast<float>(area);
    return shining_as(result, light);
}

}  // namespace

rp_light triangle_light(const Float3& a, const Float3& b, const Float3& c, const AreaLight& light) {
    rp_light result = emitter(RP_LIGHT_TRIANGLE, light, triangle_area(a, b, c));
    store(result.p, a);
    store(result.e1, {b.x - a.x, b.y - a.y, b.z - a.z});
    store(result.e2, {c.x - a.x, c.y - a.y, c.z - a.z});
    return result;
}

rp_light sphere_light(const Float3& center, float radius, const AreaLight& light) {
    rp_light result = emitter(RP_LIGHT_SPHERE, light, 4 * std::numbers::pi * double(radius) * radius);
    store(result.p, center);
    result.e1[0] = radius;
    return result;
}

rp_light shining_as(const rp_light& light, const AreaLight& area) {
    rp_light result = light;
    result.flags = area.two_sided ? RP_LIGHT_TWO_SIDED : 0;
    result.probability = 0;
    Float3 radiance = area.radiance;
    if (area.power > 0 && light.area > 0) {
        const double each = area.power / (std::numbers::pi * light.area * (area.two_sided ? 2 : 1));
        // A tiny triangle must not become infinitely bright.
        const auto times = [each](float x) { return static_cast<float>(std::min<double>(x * each, std::numeric_limits<float>::max())); };
        radiance = {times(radiance.x), times(radiance.y), times(radiance.z)};
    }
    store(result.radiance, radiance);
    return result;
}

rp_light unseen(rp_light light) {
    light.flags |= RP_LIGHT_UNSEEN;
    return light;
}

}  // namespace raypager
