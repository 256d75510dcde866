// Scattering by layered materials (abi/scene.h): a smooth or rough interface over a diffuse or metallic base, which may transmit.
//
// Both rays of a vertex begin on the same side of the surface (shading/scatter.cl). So the side is chosen first, with a probability that depends on
// the view alone; light sampling and BSDF sampling are then about that side, and both count as many times more.
#ifndef RP_LAYERS_CL
#define RP_LAYERS_CL

#include "common/noinline.cl"
#include "shading/bsdf.cl"

// What has been chosen at a vertex on a layered material.
typedef struct rp_layers {
    float3 view;    // local: z is the shading normal
    float3 color;   // of the diffuse base
    float eta;      // index of refraction beyond the interface over that before it
    float fresnel;  // reflectance of a smooth interface, seen from here
    bool below;     // the side that is scattered to: that away from the viewer
    float side;     // probability of it; 0: nothing is scattered
    float single;   // on this side: probability of the lobes of a single direction
    float glossy;   // otherwise: of the interface, not the base
    float rest;     // of the random number that chose, uniform in [0, 1)
} rp_layers;

static inline float rp_greatest(RP_MATERIAL_SPACE const float* c) { return fmax(fmax(c[0], c[1]), c[2]); }
static inline float3 rp_rgb(RP_MATERIAL_SPACE const float* c) { return (float3)(c[0], c[1], c[2]); }
static inline float rp_pow5(float x) { return x * x * (x * x) * x; }

static inline float rp_reflected(float cosine, float eta) {
    float beyond;
    return rp_fresnel_dielectric(fmin(cosine, 1.0f), eta, &beyond);
}
static inline float3 rp_schlick(float3 specular, float cosine) { return specular + (1.0f - specular) * rp_pow5(clamp(1.0f - cosine, 0.0f, 1.0f)); }

// The random number u: true with this probability; what is left of it is a random number again.
static inline bool rp_take(float probability, float* u) {
    const bool taken = *u < probability;
    *u = fmin(taken ? *u / probability : (*u - probability) / (1.0f - probability), 0x1.fffffep-1f);
    return taken;
}

static inline rp_layers rp_choose_layers(RP_MATERIAL_SPACE const rp_material* m, const rp_frame_1* f, float3 color, float u) {
    rp_layers r;
    r.view = rp_to_local(f, rp_float3(f->view));
    r.color = color;
    r.eta = (m->flags & RP_MATERIAL_SOLID) && f->back_facing ? 1.0f / m->ior : m->ior;
    r.below = false;
    r.side = r.single = r.glossy = 0.0f;
    r.rest = u;
    if (r.view.z <= 0.0f) return r;
    const bool schlick = (m->flags & (RP_MATERIAL_BLEND | RP_MATERIAL_SCHLICK)) != 0u, rough = m->alpha > 0.0f;
    r.fresnel = rp_reflected(r.view.z, r.eta);
    // Where facets lean, the interface may reflect what a smooth one would not, and the other way round.
    float share = rough ? clamp(r.fresnel, 0.05f, 0.95f) : r.fresnel;
    if (m->flags & RP_MATERIAL_THIN) share = 2.0f * share / (1.0f + share);
    const float3 normal_incidence = rp_schlick(rp_rgb(m->specular), r.view.z);
    const float interface = schlick ? fmax(fmax(normal_incidence.x, normal_incidence.y), normal_incidence.z) : rp_greatest(m->specular) * share;
    float base = m->flags & RP_MATERIAL_METAL_BASE ? 1.0f : fmax(fmax(color.x, color.y), color.z);
    if (m->flags & RP_MATERIAL_COAT) base *= 1.0f - r.fresnel;
    const float mirror = rp_greatest(m->mirror) * r.fresnel, above = base + interface + mirror;
    const bool clear = !rough || (m->flags & RP_MATERIAL_SMOOTH_REFRACTION) != 0u;
    const float refracted = rp_greatest(m->refracted) * (1.0f - (clear && rough ? r.fresnel : share)), diffuse = rp_greatest(m->transmittance),
                through = refracted + diffuse;
    if (above + through <= 0.0f) return r;
    // A whole is exactly 1: what has a single direction is asked for no light.
    r.side = rp_div(above, above + through);
    r.below = !rp_take(r.side, &r.rest);
    if (r.below) {
        r.side = 1.0f - r.side;
        r.single = clear ? rp_div(refracted, through) : 0.0f;
        r.glossy = clear ? 0.0f : rp_div(refracted, through);
    } else {
        const float one = mirror + (rough ? 0.0f : interface), spread = above - one;
        r.single = rp_div(one, above);
        r.glossy = rough && spread > 0.0f ? rp_div(interface, spread) : 0.0f;
    }
    return r;
}

// Direction beyond a smooth interface of one on this side, both away from the surface's plane on its own side.
static inline float3 rp_beyond(float3 w, float eta) {
    const float x = w.x / eta, y = w.y / eta;
    return (float3)(x, y, sqrt(fmax(1e-6f, 1.0f - x * x - y * y)));
}

// The metal under a coat: BSDF * cosine, and density. Seen and lit through a smooth interface; what is reflected between the two is summed up as if
// the metal were smooth.
static inline float3 rp_metal_base(RP_MATERIAL_SPACE const rp_material* m, const rp_layers* r, float3 l, float* density) {
    const float3 v = rp_beyond(r->view, r->eta), w = rp_beyond(l, r->eta), h = rp_normalize(v + w);
    const rp_roughness alpha = rp_base_roughness_of(m);
    const float d = rp_facets(h, alpha), lambda_v = rp_ggx_lambda(v, alpha), lambda_l = rp_ggx_lambda(w, alpha);
    const float spread = l.z / (r->eta * r->eta * w.z);  // solid angle there over that here
    const float back = rp_reflected(l.z, r->eta);
    const float3 metal = rp_fresnel_metal(m, fmin(1.0f, dot(v, h)));
    *density = d / ((1.0f + lambda_v) * 4.0f * v.z) * spread;
    const float lit = (1.0f - r->fresnel) * (1.0f - back) * d / ((1.0f + lambda_v + lambda_l) * 4.0f * v.z) * spread;
    return metal * lit / (1.0f - metal * (0.5f * (r->fresnel + back)));
}

static inline float3 rp_diffuse_base(RP_MATERIAL_SPACE const rp_material* m, const rp_layers* r, float3 l, float3 h) {
    const float3 v = r->view;
    if (m->flags & RP_MATERIAL_COAT) {
        const float through = (1.0f - r->fresnel) * (1.0f - rp_reflected(l.z, r->eta)) / (r->eta * r->eta);
        return r->color * (through * RP_INV_PI * l.z) / (1.0f - r->color * m->internal);
    }
    if (m->flags & RP_MATERIAL_BLEND) {
        const float shape = (28.0f / 23.0f) * RP_INV_PI * (1.0f - rp_pow5(1.0f - 0.5f * l.z)) * (1.0f - rp_pow5(1.0f - 0.5f * v.z));
        return r->color * (1.0f - rp_rgb(m->specular)) * (shape * l.z);
    }
    if (m->flags & RP_MATERIAL_SCHLICK) {
        const float3 s = rp_schlick(rp_rgb(m->specular), dot(v, h));
        return r->color * ((1.0f - fmax(fmax(s.x, s.y), s.z)) * RP_INV_PI * l.z);
    }
    const float azimuth = fmax(0.0f, v.x * l.x + v.y * l.y) / fmax(v.z, l.z);
    return r->color * ((1.0f + m->oren_a + m->oren_b * azimuth) * RP_INV_PI * l.z);
}

// The lobes above the surface that are spread; r->glossy: of the density.
static inline float3 rp_layers_above(RP_MATERIAL_SPACE const rp_material* m, const rp_layers* r, float3 l, float* density) {
    const float3 v = r->view, h = rp_normalize(v + l);
    float base = l.z * RP_INV_PI;
    float3 value = m->flags & RP_MATERIAL_METAL_BASE ? rp_metal_base(m, r, l, &base) : rp_diffuse_base(m, r, l, h);
    float glossy = 0.0f;
    if (m->alpha > 0.0f) {
        const rp_roughness alpha = rp_roughness_of(m);
        const float d = rp_facets(h, alpha), lambda_v = rp_ggx_lambda(v, alpha), cosine = dot(v, h);
        glossy = d / ((1.0f + lambda_v) * 4.0f * v.z);
        const float3 specular = rp_rgb(m->specular);
        if (m->flags & RP_MATERIAL_BLEND)
            value += rp_schlick(specular, cosine) * (d * l.z / (4.0f * cosine * fmax(v.z, l.z)));
        else {
            const float spread = d / ((1.0f + lambda_v + rp_ggx_lambda(l, alpha)) * 4.0f * v.z);
            value += (m->flags & RP_MATERIAL_SCHLICK ? rp_schlick(specular, cosine) : specular * rp_reflected(cosine, r->eta)) * spread;
        }
    }
    *density = mix(base, glossy, r->glossy);
    return value;
}

// Those below it: Walter et al. 2007.
static inline float3 rp_layers_below(RP_MATERIAL_SPACE const rp_material* m, const rp_layers* r, float3 l, float* density) {
    const float diffuse = -l.z * RP_INV_PI;
    float3 value = rp_rgb(m->transmittance) * diffuse;
    float glossy = 0.0f;
    if (m->alpha > 0.0f && r->glossy > 0.0f) {
        float3 h = rp_normalize(r->view + r->eta * l);
        if (h.z < 0.0f) h = -h;
        const float v_h = dot(r->view, h), l_h = dot(l, h);
        if (v_h > 0.0f && l_h < 0.0f) {
            const rp_roughness alpha = rp_roughness_of(m);
            const float lambda_v = rp_ggx_lambda(r->view, alpha), lambda_l = rp_ggx_lambda(l, alpha), sum = v_h + r->eta * l_h;
            const float common = rp_facets(h, alpha) * v_h * -l_h / (r->view.z * sum * sum);
            glossy = common * r->eta * r->eta / (1.0f + lambda_v);
            value += rp_rgb(m->refracted) * ((1.0f - rp_reflected(v_h, r->eta)) * common / (1.0f + lambda_v + lambda_l));
        }
    }
    *density = mix(diffuse, glossy, r->glossy);
    return value;
}

// BSDF * cosine over the probability of the side, and the density with which a direction on this side is sampled; without the lobes of a single
// direction.
static RP_NOINLINE float3 rp_layers_evaluate(RP_MATERIAL_SPACE const rp_material* m, const rp_frame_1* f, const rp_layers* r, float3 direction,
                                             float* density) {
    *density = 0.0f;
    const float3 l = rp_to_local(f, direction);
    const bool below = l.z < 0.0f;
    if (r->side <= 0.0f || r->single >= 1.0f || below != r->below || l.z == 0.0f || (dot(direction, rp_float3(f->geometric_normal)) < 0.0f) != below)
        return (float3)(0.0f);
    float spread;
    const float3 value = below ? rp_layers_below(m, r, l, &spread) : rp_layers_above(m, r, l, &spread);
    *density = (1.0f - r->single) * spread;
    return value / r->side;
}

// A direction on the chosen side, local; its weight where it is a single one, and whether it is.
static inline float3 rp_layers_direction(RP_MATERIAL_SPACE const rp_material* m, const rp_layers* r, float4 u, bool* single, float3* weight) {
    float rest = r->rest;
    const float3 v = r->view;
    const bool thin = (m->flags & RP_MATERIAL_THIN) != 0u;
    *single = rp_take(r->single, &rest);
    const float share = thin ? 2.0f * r->fresnel / (1.0f + r->fresnel) : r->fresnel;
    if (*single && r->below) {
        if (thin) {
            *weight = rp_rgb(m->refracted) * (1.0f - share);
            return -v;
        }
        const float3 w = rp_beyond(v, r->eta);
        *weight = rp_rgb(m->refracted) * ((1.0f - share) / (r->eta * r->eta));
        return -w;
    }
    if (*single) {
        *weight = (rp_rgb(m->mirror) + (m->alpha > 0.0f ? (float3)(0.0f) : rp_rgb(m->specular))) * share;
        return (float3)(-v.x, -v.y, v.z);
    }
    const bool glossy = rp_take(r->glossy, &rest), metal = !r->below && (m->flags & RP_MATERIAL_METAL_BASE) != 0u;
    if (!glossy && !metal) {
        const float2 p = rp_sample_disk(u.x, u.y);
        const float z = sqrt(fmax(0.0f, 1.0f - u.x));
        return (float3)(p.x, p.y, r->below ? -z : z);
    }
    const float3 from = glossy ? v : rp_beyond(v, r->eta);
    const float3 h = rp_ggx_sample_normal(from, glossy ? rp_roughness_of(m) : rp_base_roughness_of(m), u.x, u.y);
    const float cosine = dot(from, h);
    if (glossy && r->below) {
        const float beyond2 = 1.0f - (1.0f - cosine * cosine) / (r->eta * r->eta);
        return beyond2 <= 0.0f ? (float3)(0.0f) : h * (cosine / r->eta - sqrt(beyond2)) - v / r->eta;
    }
    const float3 mirrored = 2.0f * cosine * h - from;
    if (glossy) return mirrored;
    // Out of the coat again.
    const float x = mirrored.x * r->eta, y = mirrored.y * r->eta, z2 = 1.0f - x * x - y * y;
    return mirrored.z <= 0.0f || z2 <= 0.0f ? (float3)(0.0f) : (float3)(x, y, sqrt(z2));
}

static inline rp_scatter rp_layers_sample(RP_MATERIAL_SPACE const rp_material* m, const rp_frame_1* f, const rp_layers* r, float4 u) {
    rp_scatter s;
    s.direction = rp_float3(f->normal);
    s.weight = (float3)(0.0f);
    s.density = 0.0f;
    s.transmitted = r->below && (m->flags & RP_MATERIAL_THIN) == 0u && rp_greatest(m->transmittance) <= 0.0f;
    if (r->side <= 0.0f) return s;
    bool single;
    float3 weight = (float3)(0.0f);
    const float3 l = rp_layers_direction(m, r, u, &single, &weight);
    if (l.z == 0.0f || (l.z < 0.0f) != r->below) return s;
    s.direction = rp_normalize(rp_to_world(f, l));
    if ((dot(s.direction, rp_float3(f->geometric_normal)) < 0.0f) != r->below) return s;
    if (single) {
        s.weight = weight / (r->side * r->single);
        return s;
    }
    const float3 value = rp_layers_evaluate(m, f, r, s.direction, &s.density);
    if (s.density > 0.0f)
        s.weight = value / s.density;
    else
        s.density = 0.0f;
    return s;
}

#endif
