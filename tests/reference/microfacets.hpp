// GGX in the frame of the shading normal (+z) and the tangent (+x). Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR
// 2007; Heitz, Understanding the Masking-Shadowing Function, JCGT 3(2), 2014.
#pragma once

#include "raypager/abi/scene.h"
#include "reference/vector.hpp"

namespace raypager::reference {

// Along the tangent and across it; zeros: smooth.
struct Roughness {
    double x = 0, y = 0;
    bool none() const { return x <= 0; }
};
inline Roughness roughness_of(const rp_material& m) { return {double{m.alpha}, double{RP_ALPHA_ACROSS(m) > 0 ? RP_ALPHA_ACROSS(m) : m.alpha}}; }
inline Roughness base_roughness_of(const rp_material& m) {
    return {double{m.base_alpha}, double{RP_BASE_ALPHA_ACROSS(m) > 0 ? RP_BASE_ALPHA_ACROSS(m) : m.base_alpha}};
}

inline double ggx_density(const Vec3& m, const Roughness& alpha) {
    if (m.z <= 0) return 0;
    const Vec3 stretched(m.x / alpha.x, m.y / alpha.y, m.z);
    const double length2 = dot(stretched, stretched);
    return 1 / (pi * alpha.x * alpha.y * length2 * length2);
}

// By the roughness in the direction of w.
inline double smith_lambda(const Vec3& w, const Roughness& alpha) {
    const double slope_x = alpha.x * w.x / w.z, slope_y = alpha.y * w.y / w.z;
    return (std::sqrt(1 + slope_x * slope_x + slope_y * slope_y) - 1) / 2;
}

inline double masking(const Vec3& w, const Roughness& alpha) { return 1 / (1 + smith_lambda(w, alpha)); }
inline double masking_shadowing(const Vec3& a, const Vec3& b, const Roughness& alpha) {
    return 1 / (1 + smith_lambda(a, alpha) + smith_lambda(b, alpha));
}

// A normal among those visible from wo: density masking(wo) max(0, wo.m) D(m) / wo.z.
// Heitz, Sampling the GGX Distribution of Visible Normals, JCGT 7(4), 2018.
inline Vec3 sample_visible_normal(const Vec3& wo, const Roughness& alpha, double u, double v) {
    // The unit hemisphere of normals, seen along the stretched direction, is a disk one half of which is foreshortened.
    const Vec3 axis = normalized(Vec3(alpha.x * wo.x, alpha.y * wo.y, wo.z));
    const double radius = std::sqrt(u), phi = 2 * pi * v;
    const double x = radius * std::cos(phi);
    const double horizontal = axis.x * axis.x + axis.y * axis.y;
    const Vec3 t1 = horizontal > 0 ? Vec3(-axis.y, axis.x, 0) / std::sqrt(horizontal) : Vec3(1, 0, 0);
    const Vec3 t2 = cross(axis, t1);
    const double s = 0.5 * (1 + axis.z);
    const double y = (1 - s) * std::sqrt(std::max(0.0, 1 - x * x)) + s * radius * std::sin(phi);
    const Vec3 normal = x * t1 + y * t2 + std::sqrt(std::max(0.0, 1 - x * x - y * y)) * axis;
    return normalized(Vec3(alpha.x * normal.x, alpha.y * normal.y, std::max(1e-12, normal.z)));
}

}  // namespace raypager::reference
