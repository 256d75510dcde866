#include "reference/bsdf.hpp"

#include <complex>

namespace raypager::reference {
namespace {

// GGX, isotropic -----------------------------------------------------------------------------------------------------------
// In the frame of the shading normal (+z). Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007;
// Heitz, Understanding the Masking-Shadowing Function, JCGT 3(2), 2014.

double ggx_density(const Vec3& m, double alpha) {
    if (m.z <= 0) return 0;
    const double a = alpha * alpha, c = m.z * m.z;
    const double denominator = c * a + (m.x * m.x + m.y * m.y);
    return a / (pi * denominator * denominator);
}

double smith_lambda(const Vec3& w, double alpha) {
    const double tangent2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return (std::sqrt(1 + alpha * alpha * tangent2) - 1) / 2;
}

double masking(const Vec3& w, double alpha) { return 1 / (1 + smith_lambda(w, alpha)); }
double masking_shadowing(const Vec3& a, const Vec3& b, double alpha) { return 1 / (1 + smith_lambda(a, alpha) + smith_lambda(b, alpha)); }

// A normal among those visible from wo: density masking(wo) max(0, wo.m) D(m) / wo.z.
// Heitz, Sampling the GGX Distribution of Visible Normals, JCGT 7(4), 2018.
Vec3 sample_visible_normal(const Vec3& wo, double alpha, double u, double v) {
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

// Materials ------------------------------------------------------------------------------------------------------------------

bool same_side(const ScatterPoint& point, const Vec3& wi) { return dot(point.geometric_normal, wi) > 0; }

Vec3 conductor_fresnel(const rp_material& material, double cosine) {
    return {fresnel_conductor(cosine, double{material.eta[0]}, double{material.k[0]}),
            fresnel_conductor(cosine, double{material.eta[1]}, double{material.k[1]}),
            fresnel_conductor(cosine, double{material.eta[2]}, double{material.k[2]})};
}

Vec3 mirrored(const Vec3& w, const Vec3& normal) { return 2 * dot(w, normal) * normal - w; }

std::optional<ScatterSample> sample_diffuse(const rp_material& material, const ScatterPoint& point, Random& random) {
    const double u = random.uniform(), v = random.uniform();
    const Vec3 local = cosine_hemisphere(u, v);
    const Vec3 wi = Frame(point.shading_normal).to_world(local);
    if (local.z <= 0 || !same_side(point, wi)) return {};
    return ScatterSample{.wi = wi, .weight = Vec3(material.color), .pdf = local.z / pi};
}

std::optional<ScatterSample> sample_mirror(const rp_material& material, const ScatterPoint& point) {
    const double cosine = dot(point.wo, point.shading_normal);
    if (cosine <= 0) return {};
    const Vec3 wi = mirrored(point.wo, point.shading_normal);
    if (!same_side(point, wi)) return {};
    return ScatterSample{.wi = wi, .weight = conductor_fresnel(material, cosine), .specular = true};
}

std::optional<ScatterSample> sample_rough_conductor(const rp_material& material, const ScatterPoint& point, Random& random) {
    const Frame frame(point.shading_normal);
    const Vec3 wo = frame.to_local(point.wo);
    if (wo.z <= 0) return {};
    const double u = random.uniform(), v = random.uniform();
    const Vec3 wi = frame.to_world(mirrored(wo, sample_visible_normal(wo, double{material.alpha}, u, v)));
    const double density = pdf(material, point, wi);
    if (!(density > 0)) return {};
    return ScatterSample{.wi = wi, .weight = evaluate(material, point, wi) / density, .pdf = density};
}

// Smooth glass. Radiance that crosses into a medium of index n grows by n squared.
std::optional<ScatterSample> sample_dielectric(const rp_material& material, const ScatterPoint& point, Random& random) {
    const double eta = point.outside ? double{material.ior} : 1 / double{material.ior};
    const double cosine = dot(point.wo, point.shading_normal);
    if (cosine <= 0) return {};
    const double reflected = fresnel_dielectric(cosine, eta);
    if (random.uniform() < reflected) {
        const Vec3 wi = mirrored(point.wo, point.shading_normal);
        if (!same_side(point, wi)) return {};
        return ScatterSample{.wi = wi, .weight = Vec3(1), .specular = true};
    }
    const double cosine_inside = std::sqrt(std::max(0.0, 1 - (1 - cosine * cosine) / (eta * eta)));
    const Vec3 wi = normalized(-point.wo / eta + (cosine / eta - cosine_inside) * point.shading_normal);
    if (dot(point.geometric_normal, wi) >= 0) return {};
    return ScatterSample{.wi = wi, .weight = Vec3(1 / (eta * eta)), .specular = true};
}

}  // namespace

Vec3 cosine_hemisphere(double u, double v) {
    const double radius = std::sqrt(u), phi = 2 * pi * v;
    return {radius * std::cos(phi), radius * std::sin(phi), std::sqrt(std::max(0.0, 1 - u))};
}

Vec3 uniform_sphere(double u, double v) {
    const double z = 1 - 2 * u, radius = std::sqrt(std::max(0.0, 1 - z * z)), phi = 2 * pi * v;
    return {radius * std::cos(phi), radius * std::sin(phi), z};
}

bool is_specular(const rp_material& material) {
    return material.kind == RP_MATERIAL_DIELECTRIC || (material.kind == RP_MATERIAL_CONDUCTOR && material.alpha == 0);
}

Vec3 evaluate(const rp_material& material, const ScatterPoint& point, const Vec3& wi) {
    const double cosine = dot(point.shading_normal, wi);
    if (cosine <= 0 || !same_side(point, wi)) return {};
    if (material.kind == RP_MATERIAL_DIFFUSE) return Vec3(material.color) * (cosine / pi);
    if (material.kind != RP_MATERIAL_CONDUCTOR || is_specular(material)) return {};
    const Frame frame(point.shading_normal);
    const Vec3 o = frame.to_local(point.wo), i = frame.to_local(wi);
    if (o.z <= 0) return {};
    const Vec3 half = normalized(o + i);
    const double alpha{material.alpha};
    return conductor_fresnel(material, dot(o, half)) * (ggx_density(half, alpha) * masking_shadowing(o, i, alpha) / (4 * o.z));
}

double pdf(const rp_material& material, const ScatterPoint& point, const Vec3& wi) {
    const double cosine = dot(point.shading_normal, wi);
    if (cosine <= 0 || !same_side(point, wi)) return 0;
    if (material.kind == RP_MATERIAL_DIFFUSE) return cosine / pi;
    if (material.kind != RP_MATERIAL_CONDUCTOR || is_specular(material)) return 0;
    const Frame frame(point.shading_normal);
    const Vec3 o = frame.to_local(point.wo), i = frame.to_local(wi);
    if (o.z <= 0) return 0;
    const double alpha{material.alpha};
    // The density of visible normals, over the 4 (o.m) by which mirroring spreads directions.
    return masking(o, alpha) * ggx_density(normalized(o + i), alpha) / (4 * o.z);
}

std::optional<ScatterSample> sample(const rp_material& material, const ScatterPoint& point, Random& random) {
    switch (material.kind) {
        case RP_MATERIAL_DIFFUSE:
            return sample_diffuse(material, point, random);
        case RP_MATERIAL_CONDUCTOR:
            return is_specular(material) ? sample_mirror(material, point) : sample_rough_conductor(material, point, random);
        case RP_MATERIAL_DIELECTRIC:
            return sample_dielectric(material, point, random);
        default:
            return {};
    }
}

double fresnel_dielectric(double cosine, double eta) {
    const double sine2 = (1 - cosine * cosine) / (eta * eta);
    if (sine2 >= 1) return 1;
    const double transmitted = std::sqrt(1 - sine2);
    const double parallel = (eta * cosine - transmitted) / (eta * cosine + transmitted);
    const double perpendicular = (cosine - eta * transmitted) / (cosine + eta * transmitted);
    return (parallel * parallel + perpendicular * perpendicular) / 2;
}

double fresnel_conductor(double cosine, double eta, double k) {
    const std::complex<double> index(eta, k);
    const std::complex<double> transmitted = std::sqrt(1.0 - (1 - cosine * cosine) / (index * index));
    const std::complex<double> parallel = (index * cosine - transmitted) / (index * cosine + transmitted);
    const std::complex<double> perpendicular = (cosine - index * transmitted) / (cosine + index * transmitted);
    return (std::norm(parallel) + std::norm(perpendicular)) / 2;
}

}  // namespace raypager::reference
