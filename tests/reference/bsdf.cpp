#include "reference/bsdf.hpp"

#include <complex>

#include "reference/layers.hpp"
#include "reference/microfacets.hpp"

namespace raypager::reference {
namespace {

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

std::optional<ScatterSample> sample_layered(const rp_material& material, const ScatterPoint& point, Random& random) {
    const Frame frame = point.frame();
    const auto sampled = sample_layers(material, point.outside, frame.to_local(point.wo), random);
    if (!sampled) return {};
    const Vec3 wi = frame.to_world(sampled->wi);
    if (same_side(point, wi) != (sampled->wi.z > 0)) return {};
    // Not weighed against light sampling: light that has a size is found in this way alone.
    return ScatterSample{.wi = wi, .weight = sampled->weight, .specular = true};
}

std::optional<ScatterSample> sample_mirror(const rp_material& material, const ScatterPoint& point) {
    const double cosine = dot(point.wo, point.shading_normal);
    if (cosine <= 0) return {};
    const Vec3 wi = mirrored(point.wo, point.shading_normal);
    if (!same_side(point, wi)) return {};
    return ScatterSample{.wi = wi, .weight = conductor_fresnel(material, cosine), .specular = true};
}

std::optional<ScatterSample> sample_rough_conductor(const rp_material& material, const ScatterPoint& point, Random& random) {
    const Frame frame = point.frame();
    const Vec3 wo = frame.to_local(point.wo);
    if (wo.z <= 0) return {};
    const double u = random.uniform(), v = random.uniform();
    const Vec3 wi = frame.to_world(mirrored(wo, sample_visible_normal(wo, roughness_of(material), u, v)));
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

Frame ScatterPoint::frame() const {
    const bool turned = length(cross(tangent, shading_normal)) > 1e-9 * length(tangent);
    return turned ? Frame(shading_normal, tangent) : Frame(shading_normal);
}

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
    if (material.kind == RP_MATERIAL_LAYERED) {
        const Frame frame = point.frame();
        return same_side(point, wi) == (cosine > 0) ? evaluate_layers(material, point.outside, frame.to_local(point.wo), frame.to_local(wi)) : Vec3();
    }
    if (cosine <= 0 || !same_side(point, wi)) return {};
    if (material.kind == RP_MATERIAL_DIFFUSE) return Vec3(material.color) * (cosine / pi);
    if (material.kind != RP_MATERIAL_CONDUCTOR || is_specular(material)) return {};
    const Frame frame = point.frame();
    const Vec3 o = frame.to_local(point.wo), i = frame.to_local(wi);
    if (o.z <= 0) return {};
    const Vec3 half = normalized(o + i);
    const Roughness alpha = roughness_of(material);
    return conductor_fresnel(material, dot(o, half)) * (ggx_density(half, alpha) * masking_shadowing(o, i, alpha) / (4 * o.z));
}

double pdf(const rp_material& material, const ScatterPoint& point, const Vec3& wi) {
    const double cosine = dot(point.shading_normal, wi);
    if (cosine <= 0 || !same_side(point, wi)) return 0;
    if (material.kind == RP_MATERIAL_DIFFUSE) return cosine / pi;
    if (material.kind != RP_MATERIAL_CONDUCTOR || is_specular(material)) return 0;
    const Frame frame = point.frame();
    const Vec3 o = frame.to_local(point.wo), i = frame.to_local(wi);
    if (o.z <= 0) return 0;
    const Roughness alpha = roughness_of(material);
    // The density of visible normals, over the 4 (o.m) by which mirroring spreads directions.
    return masking(o, alpha) * ggx_density(normalized(o + i), alpha) / (4 * o.z);
}

std::optional<ScatterSample> sample(const rp_material& material, const ScatterPoint& point, Random& random) {
    switch (material.kind) {
        case RP_MATERIAL_DIFFUSE:
            return sample_diffuse(material, point, random);
        case RP_MATERIAL_CONDUCTOR:
            return is_specular(material) ? sample_mirror(material, point) : sample_rough_conductor(material, point, random);
        case RP_MATERIAL_LAYERED:
            return sample_layered(material, point, random);
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
