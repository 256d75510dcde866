// The GGX distribution of microfacets (Walter et al. 2007; Heitz 2014, 2018), in a local frame with z = normal.
#ifndef RP_GGX_CL
#define RP_GGX_CL

#include "common/arithmetic.cl"
#include "raypager/abi/scene.h"

// Where materials lie: with textures, and where instances change their colours, each vertex has one of its own.
#if defined(RP_TEXTURES) || defined(RP_TRAITS)
#define RP_MATERIAL_SPACE __private
#else
#define RP_MATERIAL_SPACE __global
#endif

// Alpha. In scenes where some roughness has a direction (RP_ANISOTROPIC) it is two: along the tangent, and across it.
#ifdef RP_ANISOTROPIC
typedef float2 rp_roughness;
#define RP_ALONG(alpha) (alpha).x
#define RP_ACROSS(alpha) (alpha).y
static inline rp_roughness rp_both_alphas(float along, float across) { return (float2)(along, across > 0.0f ? across : along); }
static inline rp_roughness rp_roughness_of(RP_MATERIAL_SPACE const rp_material* m) { return rp_both_alphas(m->alpha, RP_ALPHA_ACROSS(*m)); }
static inline rp_roughness rp_base_roughness_of(RP_MATERIAL_SPACE const rp_material* m) {
    return rp_both_alphas(m->base_alpha, RP_BASE_ALPHA_ACROSS(*m));
}
static inline bool rp_is_anisotropic(RP_MATERIAL_SPACE const rp_material* m) {
    return RP_ALPHA_ACROSS(*m) > 0.0f || ((m->flags & RP_MATERIAL_METAL_BASE) != 0u && RP_BASE_ALPHA_ACROSS(*m) > 0.0f);
}
#else
typedef float rp_roughness;
#define RP_ALONG(alpha) (alpha)
#define RP_ACROSS(alpha) (alpha)
static inline rp_roughness rp_roughness_of(RP_MATERIAL_SPACE const rp_material* m) { return m->alpha; }
static inline rp_roughness rp_base_roughness_of(RP_MATERIAL_SPACE const rp_material* m) { return m->base_alpha; }
#endif

#ifdef RP_ANISOTROPIC
// Multiplied through by both alphas: rounding does not hurt it where they are small.
static inline float rp_facets(float3 h, rp_roughness alpha) {
    const float a2 = alpha.x * alpha.y, stretch = alpha.x / alpha.y;
    const float t = h.x * h.x / stretch + h.y * h.y * stretch + a2 * h.z * h.z;
    return a2 / (RP_PI * t * t);
}
static inline float rp_ggx_d(float3 h, rp_roughness alpha) { return rp_facets(h, alpha); }
static inline float rp_ggx_lambda(float3 w, rp_roughness alpha) {
    const float x = alpha.x * w.x, y = alpha.y * w.y;
    return 0.5f * (sqrt(1.0f + (x * x + y * y) / (w.z * w.z)) - 1.0f);
}
#else
static inline float rp_ggx_d(float3 h, rp_roughness alpha) {
    const float a2 = alpha * alpha, t = h.z * h.z * (a2 - 1.0f) + 1.0f;
    return a2 / (RP_PI * t * t);
}
// As rp_ggx_d, in a form that rounding does not hurt where alpha is small.
static inline float rp_facets(float3 h, rp_roughness alpha) {
    const float a2 = alpha * alpha, t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
    return a2 / (RP_PI * t * t);
}
static inline float rp_ggx_lambda(float3 w, rp_roughness alpha) {
    const float c2 = w.z * w.z;
    return 0.5f * (sqrt(1.0f + alpha * alpha * fmax(0.0f, 1.0f - c2) / c2) - 1.0f);
}
#endif

static inline float2 rp_sample_disk(float u, float v) {
    float sine, cosine;
    const float r = sqrt(u);
    rp_sincos_turns_1(v, &sine, &cosine);
    return (float2)(r * cosine, r * sine);
}

// Heitz 2018, "Sampling the GGX Distribution of Visible Normals".
static inline float3 rp_ggx_sample_normal(float3 v, rp_roughness alpha, float u0, float u1) {
    const float3 s = rp_normalize((float3)(RP_ALONG(alpha) * v.x, RP_ACROSS(alpha) * v.y, v.z));
    const float length2 = s.x * s.x + s.y * s.y;
    const float3 t1 = length2 > 0.0f ? (float3)(-s.y, s.x, 0.0f) * rp_rsqrt(length2) : (float3)(1.0f, 0.0f, 0.0f);
    const float3 t2 = cross(s, t1);
    float2 p = rp_sample_disk(u0, u1);
    const float blend = 0.5f * (1.0f + s.z);
    p.y = (1.0f - blend) * sqrt(fmax(0.0f, 1.0f - p.x * p.x)) + blend * p.y;
    const float3 n = p.x * t1 + p.y * t2 + sqrt(fmax(0.0f, 1.0f - p.x * p.x - p.y * p.y)) * s;
    return rp_normalize((float3)(RP_ALONG(alpha) * n.x, RP_ACROSS(alpha) * n.y, fmax(1e-6f, n.z)));
}

#endif
