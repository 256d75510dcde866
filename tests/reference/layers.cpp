#include "reference/layers.hpp"

#include <vector>

#include "reference/microfacets.hpp"

namespace raypager::reference {
namespace {

Vec3 schlick(const Vec3& at_normal, double cosine) { return at_normal + (Vec3(1) - at_normal) * std::pow(std::max(0.0, 1 - cosine), 5); }

// Snell's law for a direction and what it becomes beyond a smooth interface; both away from the plane on one side. Nothing: total reflection.
std::optional<Vec3> refracted(const Vec3& w, double eta) {
    const double x = w.x / eta, y = w.y / eta, z2 = 1 - x * x - y * y;
    if (z2 <= 0) return {};
    return Vec3(x, y, std::sqrt(z2));
}

class Layers {
public:
    Layers(const rp_material& m, bool outside, const Vec3& wo) : m_(m), wo_(wo) {
        const double ior{m.ior};
        eta_ = has(RP_MATERIAL_SOLID) && !outside ? 1 / ior : ior;
        alpha_ = roughness_of(m);
        fresnel_ = fresnel_dielectric(wo.z, eta_);
    }

    Vec3 evaluate(const Vec3& wi) const { return wi.z > 0 ? base(wi) + interface(wi) : below(wi); }

    std::optional<LayerSample> sample(Random& random) const {
        enum Lobe { mirror, window, above, beneath };
        std::vector<Lobe> lobes;
        const Vec3 reflects = mirror_weight(), passes = window_weight();
        if (!is_black(reflects)) lobes.push_back(mirror);
        if (!is_black(passes)) lobes.push_back(window);
        if (!is_black(Vec3(m_.color)) || has(RP_MATERIAL_METAL_BASE) || (!alpha_.none() && !is_black(Vec3(m_.specular)))) lobes.push_back(above);
        if (!is_black(Vec3(m_.transmittance)) || refracts_roughly()) lobes.push_back(beneath);
        if (lobes.empty()) return {};
        const double choices = static_cast<double>(lobes.size());
        switch (lobes[static_cast<size_t>(random.uniform() * choices)]) {
            case mirror:
                return LayerSample{Vec3(-wo_.x, -wo_.y, wo_.z), reflects * choices};
            case window:
                if (has(RP_MATERIAL_THIN)) return LayerSample{-wo_, passes * choices};
                return LayerSample{-*refracted(wo_, eta_), passes * choices};
            case above:
                return spread(sample_above(random), choices, above_density);
            default:
                return spread(sample_below(random), choices, below_density);
        }
    }

private:
    bool has(uint32_t flag) const { return (m_.flags & flag) != 0; }
    bool refracts_roughly() const { return !alpha_.none() && !has(RP_MATERIAL_SMOOTH_REFRACTION) && !is_black(Vec3(m_.refracted)); }
    double reflected_share() const { return has(RP_MATERIAL_THIN) ? 2 * fresnel_ / (1 + fresnel_) : fresnel_; }

    Vec3 mirror_weight() const { return (Vec3(m_.mirror) + (!alpha_.none() ? Vec3() : Vec3(m_.specular))) * reflected_share(); }
    Vec3 window_weight() const {
        if (!alpha_.none() && !has(RP_MATERIAL_SMOOTH_REFRACTION)) return {};
        const double passes = 1 - reflected_share();
        return Vec3(m_.refracted) * (has(RP_MATERIAL_THIN) ? passes : passes / (eta_ * eta_));
    }

    Vec3 interface(const Vec3& wi) const {
        if (alpha_.none()) return {};
        const Vec3 h = normalized(wo_ + wi);
        const double d = ggx_density(h, alpha_), cosine = dot(wi, h);
        if (has(RP_MATERIAL_BLEND)) return schlick(Vec3(m_.specular), cosine) * (d * wi.z / (4 * cosine * std::max(wo_.z, wi.z)));
        const double facets = d * masking_shadowing(wo_, wi, alpha_) / (4 * wo_.z);
        return (has(RP_MATERIAL_SCHLICK) ? schlick(Vec3(m_.specular), cosine) : Vec3(m_.specular) * fresnel_dielectric(cosine, eta_)) * facets;
    }

    Vec3 base(const Vec3& wi) const {
        if (has(RP_MATERIAL_METAL_BASE)) return metal(wi);
        const Vec3 color(m_.color), lambert = color * (wi.z / pi);
        if (has(RP_MATERIAL_COAT)) {
            const double through = (1 - fresnel_) * (1 - fresnel_dielectric(wi.z, eta_)) / (eta_ * eta_), inside{m_.internal};
            return lambert * through * Vec3(1 / (1 - inside * color.x), 1 / (1 - inside * color.y), 1 / (1 - inside * color.z));
        }
        if (has(RP_MATERIAL_BLEND)) {
            const auto fade = [](double cosine) { return 1 - std::pow(1 - cosine / 2, 5); };
            return lambert * (Vec3(1) - Vec3(m_.specular)) * (28.0 / 23 * fade(wi.z) * fade(wo_.z));
        }
        if (has(RP_MATERIAL_SCHLICK)) return lambert * (1 - max_component(schlick(Vec3(m_.specular), dot(wi, normalized(wo_ + wi)))));
        // Oren and Nayar 1994, equation 30 without interreflection. sin(alpha) tan(beta), alpha the larger angle.
        const double sine_o = std::sqrt(std::max(0.0, 1 - wo_.z * wo_.z)), sine_i = std::sqrt(std::max(0.0, 1 - wi.z * wi.z));
        const double turn = sine_o > 0 && sine_i > 0 ? (wo_.x * wi.x + wo_.y * wi.y) / (sine_o * sine_i) : 0;
        const double steep = wo_.z < wi.z ? sine_o * sine_i / wi.z : sine_i * sine_o / wo_.z;
        return lambert * (1 + double{m_.oren_a} + double{m_.oren_b} * std::max(0.0, turn) * steep);
    }

    // Weidlich and Wilkie 2007, with the reflections between metal and coat summed up.
    Vec3 metal(const Vec3& wi) const {
        const auto o = refracted(wo_, eta_), i = refracted(wi, eta_);
        if (!o || !i) return {};
        const Vec3 h = normalized(*o + *i);
        const Roughness alpha = base_roughness_of(m_);
        const double cosine = dot(*o, h), back = fresnel_dielectric(wi.z, eta_);
        const double f = ggx_density(h, alpha) * masking_shadowing(*o, *i, alpha) / (4 * o->z * i->z);
        Vec3 result;
        double* const out[] = {&result.x, &result.y, &result.z};
        for (int k = 0; k < 3; k++) {
            const double reflected = fresnel_conductor(cosine, double{m_.eta[k]}, double{m_.k[k]});
            *out[k] = reflected * f * (1 - fresnel_) * (1 - back) / (eta_ * eta_) * wi.z / (1 - reflected * (fresnel_ + back) / 2);
        }
        return result;
    }

    // Half vector of a refraction, on the side of wo.
    std::optional<Vec3> bending_normal(const Vec3& wi) const {
        Vec3 h = normalized(wo_ + eta_ * wi);
        if (h.z < 0) h = -h;
        if (dot(wo_, h) <= 0 || dot(wi, h) >= 0) return {};
        return h;
    }

    Vec3 below(const Vec3& wi) const {
        Vec3 value = Vec3(m_.transmittance) * (-wi.z / pi);
        if (!refracts_roughly()) return value;
        if (const auto h = bending_normal(wi)) {
            const double o_h = dot(wo_, *h), i_h = dot(wi, *h), sum = o_h + eta_ * i_h;
            const Vec3 up(wi.x, wi.y, -wi.z);
            const double f = o_h * -i_h / (wo_.z * -wi.z) * ggx_density(*h, alpha_) * masking_shadowing(wo_, up, alpha_) / (sum * sum);
            value += Vec3(m_.refracted) * (f * (1 - fresnel_dielectric(o_h, eta_)) * -wi.z);
        }
        return value;
    }

    // What is tried above: half by the cosine, half by the microfacets that there are.
    Roughness facet_alpha() const { return !alpha_.none() ? alpha_ : has(RP_MATERIAL_METAL_BASE) ? base_roughness_of(m_) : Roughness(); }
    Vec3 sample_above(Random& random) const {
        const bool facets = !facet_alpha().none() && random.uniform() < 0.5;
        const double u = random.uniform(), v = random.uniform();
        if (!facets) return cosine_hemisphere(u, v);
        const Vec3 h = sample_visible_normal(wo_, facet_alpha(), u, v);
        return 2 * dot(wo_, h) * h - wo_;
    }
    static double above_density(const Layers& l, const Vec3& wi) {
        if (wi.z <= 0) return 0;
        const Roughness alpha = l.facet_alpha();
        if (alpha.none()) return wi.z / pi;
        return (wi.z / pi + masking(l.wo_, alpha) * ggx_density(normalized(l.wo_ + wi), alpha) / (4 * l.wo_.z)) / 2;
    }
    Vec3 sample_below(Random& random) const {
        const bool facets = refracts_roughly() && random.uniform() < 0.5;
        const double u = random.uniform(), v = random.uniform();
        if (!facets) return -cosine_hemisphere(u, v);
        const Vec3 h = sample_visible_normal(wo_, alpha_, u, v);
        const double cosine = dot(wo_, h), beyond2 = 1 - (1 - cosine * cosine) / (eta_ * eta_);
        if (beyond2 <= 0) return {};
        return normalized((cosine / eta_ - std::sqrt(beyond2)) * h - wo_ / eta_);
    }
    static double below_density(const Layers& l, const Vec3& wi) {
        if (wi.z >= 0) return 0;
        if (!l.refracts_roughly()) return -wi.z / pi;
        double facets = 0;
        if (const auto h = l.bending_normal(wi)) {
            const double o_h = dot(l.wo_, *h), i_h = dot(wi, *h), sum = o_h + l.eta_ * i_h;
            facets = masking(l.wo_, l.alpha_) * ggx_density(*h, l.alpha_) * o_h / l.wo_.z * l.eta_ * l.eta_ * -i_h / (sum * sum);
        }
        return (-wi.z / pi + facets) / 2;
    }

    std::optional<LayerSample> spread(const Vec3& wi, double choices, double (*density_of)(const Layers&, const Vec3&)) const {
        const double density = density_of(*this, wi);
        if (!(density > 0)) return {};
        return LayerSample{wi, evaluate(wi) * (choices / density)};
    }

    const rp_material& m_;
    const Vec3 wo_;
    double eta_, fresnel_;
    Roughness alpha_;
};

}  // namespace

Vec3 evaluate_layers(const rp_material& material, bool outside, const Vec3& wo, const Vec3& wi) {
    return wo.z > 0 && wi.z != 0 ? Layers(material, outside, wo).evaluate(wi) : Vec3();
}

std::optional<LayerSample> sample_layers(const rp_material& material, bool outside, const Vec3& wo, Random& random) {
    if (wo.z <= 0) return {};
    return Layers(material, outside, wo).sample(random);
}

}  // namespace raypager::reference
