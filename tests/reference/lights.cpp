#include "reference/lights.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "reference/light_images.hpp"

namespace raypager::reference {
namespace {

double average(const Vec3& c) { return (c.x + c.y + c.z) / 3; }

}  // namespace

Lights::Lights(const Scene& scene, const ReferenceGeometry& geometry) : scene_(scene), geometry_(geometry) {
    probability_of_primitive_.resize(geometry.primitive_count());
    for (uint32_t id = 0; id < geometry.primitive_count(); id++) {
        const AreaLight* light = area_light(id);
        if (!light || geometry.is_degenerate(id)) continue;
        add({.primitive = id}, pi * geometry.area(id) * average(Vec3(light->radiance)) * (light->two_sided ? 2 : 1));
    }
    const double scene_radius = geometry.lower().x <= geometry.upper().x ? length(geometry.upper() - geometry.lower()) / 2 : 1;
    for (const rp_light& light : scene.lights) {
        const Vec3 radiance(light.radiance);
        const double disk = pi * scene_radius * scene_radius;
        if (light.kind == RP_LIGHT_INFINITE) {
            if (light.flags >> RP_LIGHT_IMAGE_SHIFT)
                sky_ = &light;
            else
                infinite_radiance_ += radiance;
            add({.other = &light}, pi * disk * average(radiance));
        } else if (light.kind == RP_LIGHT_DISTANT) {
            add({.other = &light}, disk * average(radiance));
        } else if (light.kind >= RP_LIGHT_POINT) {
            add({.other = &light}, 4 * pi * average(radiance));
        } else {
            RAYPAGER_CHECK(light.flags & RP_LIGHT_UNSEEN);
            add({.other = &light}, pi * light.area * average(radiance) * (light.flags & RP_LIGHT_TWO_SIDED ? 2 : 1));
        }
    }
    normalize_probabilities();
}

const AreaLight* Lights::area_light(uint32_t primitive) const {
    const std::optional<uint32_t> index = scene_.shapes[geometry_.shape_of(primitive)].area_light;
    return index ? &scene_.area_lights[*index] : nullptr;
}

void Lights::add(Light light, double power) {
    if (!(power > 0)) return;
    light.probability = power;
    lights_.push_back(light);
}

// Half by power, half evenly, so that a weak light close by is not starved.
void Lights::normalize_probabilities() {
    double power = 0;
    for (const Light& light : lights_) power += light.probability;
    double sum = 0;
    for (Light& light : lights_) {
        light.probability = 0.5 * light.probability / power + 0.5 / static_cast<double>(lights_.size());
        light.cumulative = sum += light.probability;
        if (light.primitive != RP_NONE) probability_of_primitive_[light.primitive] = light.probability;
        if (light.other && light.other->kind == RP_LIGHT_INFINITE) infinite_probability_ = light.probability;
    }
}

const Lights::Light& Lights::choose(double u) const {
    const auto at = std::upper_bound(lights_.begin(), lights_.end(), u, [](double value, const Light& light) { return value < light.cumulative; });
    return at == lights_.end() ? lights_.back() : *at;
}

std::optional<LightSample> Lights::sample(const Vec3& position, const Vec3& normal, Random& random) const {
    const Light& light = choose(random.uniform());
    if (light.primitive != RP_NONE) return sample_surface(light, position, random);
    if (light.other->kind == RP_LIGHT_INFINITE) return sample_infinite(normal, random);
    if (light.other->flags & RP_LIGHT_UNSEEN) return sample_unseen(light, position, random);
    LightSample s{.radiance = Vec3(light.other->radiance), .pdf = light.probability, .delta = true};
    if (light.other->kind == RP_LIGHT_DISTANT) {
        s.wi = normalized(Vec3(light.other->p));
        return s;
    }
    s.target = Vec3(light.other->p);
    s.distance = length(s.target - position);
    if (!(s.distance > 0)) return {};
    s.wi = (s.target - position) / s.distance;
    s.radiance = lamp_intensity(*light.other, scene_.light_images, -s.wi) / (s.distance * s.distance);
    return s;
}

// Uniformly by area, over spheres as well.
std::optional<LightSample> Lights::sample_surface(const Light& light, const Vec3& position, Random& random) const {
    const double u = random.uniform(), v = random.uniform();
    Hit hit{.primitive = light.primitive};
    if (geometry_.is_sphere(light.primitive)) {
        hit.normal = uniform_sphere(u, v);
    } else {
        const double root = std::sqrt(u);
        hit.u = root * (1 - v);
        hit.v = root * v;
        const Corners p = geometry_.corners(light.primitive);
        hit.normal = normalized(cross(p[1] - p[0], p[2] - p[0]));
    }
    LightSample s;
    s.target = geometry_.position(hit);
    s.distance = length(s.target - position);
    if (!(s.distance > 0)) return {};
    s.wi = (s.target - position) / s.distance;
    s.radiance = emitted(hit, s.wi);
    s.pdf = pdf_of_hit(hit, s.wi, s.distance);
    s.target_normal = dot(hit.normal, s.wi) < 0 ? hit.normal : -hit.normal;
    if (is_black(s.radiance) || !std::isfinite(s.pdf)) return {};
    return s;
}

std::optional<LightSample> Lights::sample_infinite(const Vec3& normal, Random& random) const {
    const double u = random.uniform(), v = random.uniform();
    LightSample s{
        .wi = Frame(normal).to_world(cosine_hemisphere(u, v)),
    };
    s.radiance = infinite_radiance(s.wi);
    s.pdf = pdf_of_infinite(normal, s.wi);
    if (!(s.pdf > 0)) return {};
    return s;
}

Vec3 Lights::infinite_radiance(const Vec3& direction) const {
    if (!sky_) return infinite_radiance_;
    const Vec3 of_image(dot(Vec3(sky_->p), direction), dot(Vec3(sky_->e1), direction), dot(Vec3(sky_->e2), direction));
    return color_in_direction(*scene_.light_images[(sky_->flags >> RP_LIGHT_IMAGE_SHIFT) - 1], of_image);
}

// Rays go to the light itself, where nothing is in their way.
std::optional<LightSample> Lights::sample_unseen(const Light& light, const Vec3& position, Random& random) const {
    const rp_light& other = *light.other;
    const double u = random.uniform(), v = random.uniform();
    Vec3 normal, target(other.p);
    if (other.kind == RP_LIGHT_SPHERE) {
        normal = uniform_sphere(u, v);
        target += other.e1[0] * normal;
    } else {
        normal = normalized(cross(Vec3(other.e1), Vec3(other.e2)));
        target += std::sqrt(u) * ((1 - v) * Vec3(other.e1) + v * Vec3(other.e2));
    }
    LightSample s{.target = target, .radiance = Vec3(other.radiance), .delta = true};
    s.distance = length(target - position);
    if (!(s.distance > 0)) return {};
    s.wi = (target - position) / s.distance;
    const double towards = -dot(normal, s.wi), cosine = other.flags & RP_LIGHT_TWO_SIDED ? std::abs(towards) : towards;
    if (!(cosine > 0)) return {};
    s.pdf = light.probability * s.distance * s.distance / (cosine * other.area);
    return s;
}

Vec3 Lights::emitted(const Hit& hit, const Vec3& direction) const {
    const AreaLight* light = area_light(hit.primitive);
    if (!light || !(light->two_sided || dot(hit.normal, direction) < 0)) return {};
    return Vec3(light->radiance);
}

double Lights::pdf_of_hit(const Hit& hit, const Vec3& direction, double distance) const {
    return probability_of_primitive_[hit.primitive] * distance * distance / (std::abs(dot(hit.normal, direction)) * geometry_.area(hit.primitive));
}

double Lights::pdf_of_infinite(const Vec3& normal, const Vec3& direction) const {
    return infinite_probability_ * std::max(0.0, dot(normal, direction)) / pi;
}

}  // namespace raypager::reference
