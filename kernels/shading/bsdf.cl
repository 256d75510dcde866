// Scattering by the materials of abi/scene.h that are not diffuse (for those: scatter_lanes.cl): evaluates and samples them.
#ifndef RP_BSDF_CL
#define RP_BSDF_CL

#include "common/normal.cl"
#include "shading/light.cl"
#include "shading/ggx.cl"
#include "raypager/abi/scene.h"

#define RP_LANES 1
#include "shading/frame_lanes.cl"
#undef RP_LANES

static inline float3 rp_to_local(const rp_frame_1* f, float3 v) {
    return (float3)(dot(v, rp_float3(f->tangent)), dot(v, rp_float3(f->bitangent)), dot(v, rp_float3(f->normal)));
}
// Not rp_to_world_1: what compilers of GPUs fuse in one expression they may not fuse there, and the picture would be another one.
static inline float3 rp_to_world(const rp_frame_1* f, float3 v) {
    return v.x * rp_float3(f->tangent) + v.y * rp_float3(f->bitangent) + v.z * rp_float3(f->normal);
}

// Fresnel reflectance of a conductor for unpolarised light, one channel; cosine of the angle of incidence > 0.
static inline float rp_fresnel_conductor(float cosine, float eta, float k) {
    const float c2 = cosine * cosine, s2 = 1.0f - c2, e2 = eta * eta, k2 = k * k;
    const float t0 = e2 - k2 - s2, a2b2 = sqrt(t0 * t0 + 4.0f * e2 * k2), t1 = a2b2 + c2;
    const float a = sqrt(fmax(0.0f, 0.5f * (a2b2 + t0))), t2 = 2.0f * cosine * a;
    const float rs = (t1 - t2) / (t1 + t2);
    const float t3 = c2 * a2b2 + s2 * s2, t4 = t2 * s2;
    return 0.5f * rs * (1.0f + (t3 - t4) / (t3 + t4));
}
static inline float3 rp_fresnel_metal(RP_MATERIAL_SPACE const rp_material* m, float cosine) {
    return (float3)(rp_fresnel_conductor(cosine, m->eta[0], m->k[0]), rp_fresnel_conductor(cosine, m->eta[1], m->k[1]),
                    rp_fresnel_conductor(cosine, m->eta[2], m->k[2]));
}

// Fresnel reflectance of a dielectric; eta = index on the far side over index on this side; *cosine_t is that of refraction.
static inline float rp_fresnel_dielectric(float cosine, float eta, float* cosine_t) {
    const float sin2_t = (1.0f - cosine * cosine) / (eta * eta);
    *cosine_t = 0.0f;
    if (sin2_t >= 1.0f) return 1.0f;
    *cosine_t = sqrt(1.0f - sin2_t);
    const float parallel = (eta * cosine - *cosine_t) / (eta * cosine + *cosine_t);
    const float perpendicular = (cosine - eta * *cosine_t) / (cosine + eta * *cosine_t);
    return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

static inline bool rp_is_specular(RP_MATERIAL_SPACE const rp_material* m) {
    return m->kind == RP_MATERIAL_DIELECTRIC || m->kind == RP_MATERIAL_ABSORBING || (m->kind == RP_MATERIAL_CONDUCTOR && m->alpha <= 0.0f);
}

// BSDF * cosine and density by solid angle of the unit direction; zero for specular materials and below the geometric surface.
static inline float3 rp_bsdf_evaluate(RP_MATERIAL_SPACE const rp_material* m, const rp_frame_1* f, float3 direction, float* density) {
    *density = 0.0f;
    const float3 v = rp_to_local(f, rp_float3(f->view)), l = rp_to_local(f, direction);
    if (rp_is_specular(m) || l.z <= 0.0f || v.z <= 0.0f || dot(direction, rp_float3(f->geometric_normal)) <= 0.0f) return (float3)(0.0f);
    const float3 h = rp_normalize(v + l);
    const rp_roughness alpha = rp_roughness_of(m);
    const float d = rp_ggx_d(h, alpha), lambda_v = rp_ggx_lambda(v, alpha), lambda_l = rp_ggx_lambda(l, alpha);
    *density = d / ((1.0f + lambda_v) * 4.0f * v.z);
    return rp_fresnel_metal(m, fmin(1.0f, dot(v, h))) * (d / ((1.0f + lambda_v + lambda_l) * 4.0f * v.z));
}

typedef struct rp_scatter {
    float3 direction;  // unit, world
    float3 weight;     // BSDF * cosine / density; zero: absorbed
    float density;     // by solid angle; 0 for specular scattering
    bool transmitted;  // went to the other side of the surface
} rp_scatter;

static inline rp_scatter rp_bsdf_sample(RP_MATERIAL_SPACE const rp_material* m, const rp_frame_1* f, float4 u) {
    rp_scatter r;
    r.direction = rp_float3(f->normal);
    r.weight = (float3)(0.0f);
    r.density = 0.0f;
    r.transmitted = false;
    const float3 v = rp_to_local(f, rp_float3(f->view));
    if (m->kind == RP_MATERIAL_ABSORBING || v.z <= 0.0f) return r;
    if (m->kind == RP_MATERIAL_CONDUCTOR) {
        const bool mirror = m->alpha <= 0.0f;
        const rp_roughness alpha = rp_roughness_of(m);
        const float3 h = mirror ? (float3)(0.0f, 0.0f, 1.0f) : rp_ggx_sample_normal(v, alpha, u.x, u.y);
        const float3 l = 2.0f * dot(v, h) * h - v;
        r.direction = rp_to_world(f, l);
        if (l.z <= 0.0f || dot(r.direction, rp_float3(f->geometric_normal)) <= 0.0f) return r;
        r.weight = rp_fresnel_metal(m, clamp(dot(v, h), 0.0f, 1.0f));
        if (!mirror) {
            const float lambda_v = rp_ggx_lambda(v, alpha), lambda_l = rp_ggx_lambda(l, alpha);
            r.weight *= (1.0f + lambda_v) / (1.0f + lambda_v + lambda_l);
            r.density = rp_ggx_d(h, alpha) / ((1.0f + lambda_v) * 4.0f * v.z);
        }
    } else {
        const float eta = f->back_facing ? 1.0f / m->ior : m->ior;
        float cosine_t;
        const float reflectance = rp_fresnel_dielectric(fmin(v.z, 1.0f), eta, &cosine_t);
        float3 l;
        if (u.z < reflectance) {
            l = (float3)(-v.x, -v.y, v.z);
            r.weight = (float3)(1.0f);
        } else {
            l = (float3)(-v.x / eta, -v.y / eta, -cosine_t);
            r.weight = (float3)(1.0f / (eta * eta));  // radiance is compressed or spread with the solid angle
            r.transmitted = true;
        }
        r.direction = rp_to_world(f, l);
        // A bent shading normal can send the ray to the wrong side of the surface.
        if ((dot(r.direction, rp_float3(f->geometric_normal)) > 0.0f) == r.transmitted) r.weight = (float3)(0.0f);
    }
    r.direction = rp_normalize(r.direction);
    return r;
}

#endif
