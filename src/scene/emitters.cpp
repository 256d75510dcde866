#include "scene/emitters.hpp"

#include <cmath>
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

rp_light emitter(uint32_t kind, const AreaLight& light) {
    rp_light result = {};
    result.kind = kind;
    result.flags = light.two_sided ? RP_LIGHT_TWO_SIDED : 0;
    store(result.radiance, light.radiance);
    return result;
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

rp_light sphere_light(const Float3& center, float radius, const AreaLight& light) {
    rp_light result = emitter(RP_LIGHT_SPHERE, light);
    store(result.p, center);
    result.e1[0] = radius;
    result.area = static_cast<float>(4 * std::numbers::pi * double(radius) * radius);
    return result;
}

rp_light unseen(rp_light light) {
    light.flags |= RP_LIGHT_UNSEEN;
    return light;
}

}  // namespace raypager
