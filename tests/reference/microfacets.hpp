// GGX, isotropic, in the frame of the shading normal (+z). Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007;
// Heitz, Understanding the Masking-Shadowing Function, JCGT 3(2), 2014.
#pragma once

#include "reference/vector.hpp"

namespace raypager::reference {

inline double ggx_density(const Vec3& m, double alpha) {
    if (m.z <= 0) return 0;
    const double a = alpha * alpha, c = m.z * m.z;
    const double denominator = c * a + (m.x * m.x + m.y * m.y);
    return a / (pi * denominator * denominator);
}

inline double smith_lambda(const Vec3& w, double alpha) {
    const double tangent2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return (std::sqrt(1 + alpha * alpha * tangent2) - 1) / 2;
}

inline double masking(const Vec3& w, double alpha) { return 1 / (1 + smith_lambda(w, alpha)); }
inline double masking_shadowing(const Vec3& a, const Vec3& b, double alpha) { return 1 / (1 + smith_lambda(a, alpha) + smith_lambda(b, alpha)); }

// A normal among those visible from wo: density masking(wo) max(0, wo.m) D(m) / wo.z.
// Heitz, Sampling the GGX Distribution of Visible Normals, JCGT 7(4), 2018.
inline Vec3 sample_visible_normal(const Vec3& wo, double alpha, double u, double v) {
    // The unit hemisphere of normals, seen along the stretched direction, is a disk one half of which is foreshortened.
    const Vec3 axis = normalized(Vec3(alpha * wo.x, alpha * wo.y, wo.z));
    const double radius = std::sqrt(u), phi = 2 * pi * v;
    const double x = radius * std::cos(phi);
    const double horizontal = axis.x * axis.x + axis.y * axis.y;
    const Vec3 t1 = horizontal > 0 ? Vec3(-axis.y, axis.x, 0) / std::sqrt(horizontal) : Vec3(1, 0, 0);
    const Vec3 t2 = cross(axis, t1);
    const double s = 0.5 * (1 + axis.z);
    const double y = (1 - s) * std::sqrt(std::max(0.0, 1 - x * x)) + s * radius * std::sin(phi);
    const Vec3 normal = x * t1 + y * t2 + std::sqrt(std::max(0.0, 1 - x * x - y * y)) * axis;
    return normalized(Vec3(alpha * normal.x, alpha * normal.y, std::max(1e-12, normal.z)));
}

}  // namespace raypager::reference
