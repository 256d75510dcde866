// What happens at a vertex of a path: it connects to a light (the shadow ray is traced by the stage `connect`), and scatters. Next-event estimation
// and BSDF sampling are combined by multiple importance sampling (Veach 1997), as in pbrt's path integrator (Pharr, Jakob, Humphreys 2023,
// chapter 13.4).
#ifndef RP_SCATTER_CL
#define RP_SCATTER_CL

#include "common/noinline.cl"
#include "shading/bsdf.cl"
#ifdef RP_LAYERED
#include "shading/layers.cl"
#endif
#include "raypager/abi/path.h"

// Russian roulette begins after so many scattering events; a path goes on with this times its throughput as probability (bench/journal/sampling.md).
#define RP_ROULETTE_DEPTH 2u
#define RP_ROULETTE_SCALE 1.5f
#define RP_MAX_SPARED 32u  // scattering events up to which specular surfaces are spared

#define RP_LANES 1
#include "shading/scatter_lanes.cl"
#undef RP_LANES
#if RP_SHADE_LANES == 16
#define RP_LANES 16
#include "common/normal_lanes.cl"
#include "common/random_lanes.cl"
#include "shading/frame_lanes.cl"
#include "shading/light_lanes.cl"
#include "shading/scatter_lanes.cl"
#undef RP_LANES
#endif

// Logarithm of the square of an index of refraction, in steps of about 1/256: exponent and mantissa of a float, read as one number.
static inline int rp_refraction(float ior) { return clamp((as_int(ior * ior) - 0x3f800000) >> 15, -2048, 2048); }

// The shadow ray to a light. scattered: BSDF * cosine towards it; density: of sampling that direction by the BSDF.
static inline void rp_connect_to_light(const rp_vertex_1* vertex, const rp_light_sample_1* light, float3 scattered, float density,
                                       rp_departure_1* out) {
    const float weight = light->density > 0.0f ? rp_mis_weight_1(light->density, density) : 1.0f;
    out->light = rp_times_1(rp_product_1(rp_product_1(out->throughput, rp_vector_of(scattered)), light->radiance), weight);
#ifdef RP_SKY_PAGED
    out->light = rp_product_1(out->light, vertex->sky);
#endif
    out->light_direction = light->direction;
    out->light_reach = light->reach;
    out->shadow = out->light.x > 0.0f || out->light.y > 0.0f || out->light.z > 0.0f;
}

// The frame at a vertex. Where roughness has a direction, that is the way in which u grows, made perpendicular to the normal (as in pbrt, Pharr,
// Jakob, Humphreys 2023, chapter 3.10); on a sphere it is around its axis. Where neither says anything, the geometric normal decides.
static inline rp_frame_1 rp_frame_at(RP_MATERIAL_SPACE const rp_material* material, const rp_vertex_1* vertex) {
    rp_frame_1 frame = rp_make_frame_1(vertex->direction, vertex->geometric_normal, vertex->shading_normal);
#ifdef RP_ANISOTROPIC
    if (!rp_is_anisotropic(material)) return frame;
    const float3 n = rp_float3(frame.normal);
    float3 along;
    if (vertex->tangent != RP_NONE)
        along = rp_decode_normal(vertex->tangent);
    else if (RP_SPHERE_AXIS(*material) != 0u)
        along = cross(rp_decode_normal(~RP_SPHERE_AXIS(*material)), rp_float3(frame.geometric_normal));
    else
        along = rp_float3(rp_make_frame_1(vertex->direction, vertex->geometric_normal, vertex->geometric_normal).tangent);
    along -= dot(along, n) * n;
    const float length2 = dot(along, along);
    if (length2 < 1e-12f) return frame;
    along /= sqrt(length2);
    frame.tangent = rp_vector_of(along);
    frame.bitangent = rp_vector_of(cross(n, along));
#endif
    return frame;
}

// As rp_scatter_diffuse_1, at surfaces of other materials.
static inline void rp_scatter_special(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                      RP_MATERIAL_SPACE const rp_material* material, const rp_vertex_1* vertex, rp_departure_1* out) {
    const rp_numbers_1 light_bits = rp_random_bits_1(vertex->pixel, vertex->sample, vertex->depth + 1u, RP_RANDOM_LIGHT, params->seed);
    const rp_numbers_1 bits = rp_random_bits_1(vertex->pixel, vertex->sample, vertex->depth + 1u, RP_RANDOM_BSDF, params->seed);
    const rp_frame_1 frame = rp_frame_at(material, vertex);
    const rp_vector_1 away = rp_times_1(frame.geometric_normal, vertex->offset);
    out->start = rp_plus_1(vertex->position, away);
    out->throughput = vertex->throughput;
    rp_choose_rays_1(params, params->light_count != 0u && !rp_is_specular(material), bits.w, out);
    if (out->shadow) {
        const rp_light_sample_1 light = rp_sample_light_1(lights, light_steps, params->light_count, out->start, light_bits);
        float density;
        const float3 reflected = rp_bsdf_evaluate(material, &frame, rp_float3(light.direction), &density);
        rp_connect_to_light(vertex, &light, reflected, density, out);
    }
    if (!out->go_on) return;
    const float4 numbers = (float4)(rp_unit_1(bits.x), rp_unit_1(bits.y), rp_unit_1(bits.z), rp_unit_1(bits.w));
    const rp_scatter scatter = rp_bsdf_sample(material, &frame, numbers);
    out->direction = rp_vector_of(scatter.direction);
    out->density = scatter.density;
    out->throughput = rp_product_1(out->throughput, rp_vector_of(scatter.weight));
    out->refraction = vertex->refraction;
    if (scatter.transmitted) {
        // Both rays of a vertex begin at the same point: only specular scattering leaves on the other side, and it has no shadow ray.
        out->start = rp_minus_1(vertex->position, away);
        const int change = rp_refraction(material->ior);
        out->refraction = clamp(vertex->refraction + (frame.back_facing ? -change : change), -RP_PATH_MAX_REFRACTION, RP_PATH_MAX_REFRACTION);
    }
    // Specular surfaces make no connection: what comes next is all that a path brings from there. But one between mirrors ends some day.
    if (rp_is_specular(material) && vertex->depth < RP_MAX_SPARED)
        out->go_on = out->throughput.x > 0.0f || out->throughput.y > 0.0f || out->throughput.z > 0.0f;
    else
        rp_survive_1(vertex->depth, rp_unit_1(light_bits.w), out);
}

#ifdef RP_LAYERED
// The same at layered materials.
static RP_NOINLINE void rp_scatter_layered(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                           RP_MATERIAL_SPACE const rp_material* material, const rp_vertex_1* vertex, rp_departure_1* out) {
    const rp_numbers_1 light_bits = rp_random_bits_1(vertex->pixel, vertex->sample, vertex->depth + 1u, RP_RANDOM_LIGHT, params->seed);
    const rp_numbers_1 bits = rp_random_bits_1(vertex->pixel, vertex->sample, vertex->depth + 1u, RP_RANDOM_BSDF, params->seed);
    const rp_frame_1 frame = rp_frame_at(material, vertex);
    const rp_layers layers = rp_choose_layers(material, &frame, rp_float3(vertex->reflectance), rp_unit_1(bits.z));
    const rp_vector_1 away = rp_times_1(frame.geometric_normal, layers.below ? -vertex->offset : vertex->offset);
    out->start = rp_plus_1(vertex->position, away);
    out->throughput = vertex->throughput;
    rp_choose_rays_1(params, params->light_count != 0u && layers.side > 0.0f && layers.single < 1.0f, bits.w, out);
    if (out->shadow) {
        const rp_light_sample_1 light = rp_sample_light_1(lights, light_steps, params->light_count, out->start, light_bits);
        float density;
        const float3 scattered = rp_layers_evaluate(material, &frame, &layers, rp_float3(light.direction), &density);
        rp_connect_to_light(vertex, &light, scattered, density, out);
    }
    if (!out->go_on) return;
    const rp_scatter scatter = rp_layers_sample(material, &frame, &layers, (float4)(rp_unit_1(bits.x), rp_unit_1(bits.y), 0.0f, 0.0f));
    out->direction = rp_vector_of(scatter.direction);
    out->density = scatter.density;
    out->throughput = rp_product_1(out->throughput, rp_vector_of(scatter.weight));
    out->refraction = vertex->refraction;
    if (scatter.transmitted) {
        const int change = rp_refraction(layers.eta);
        out->refraction = clamp(vertex->refraction + change, -RP_PATH_MAX_REFRACTION, RP_PATH_MAX_REFRACTION);
    }
    if (layers.single >= 1.0f && vertex->depth < RP_MAX_SPARED)
        out->go_on = out->throughput.x > 0.0f || out->throughput.y > 0.0f || out->throughput.z > 0.0f;
    else
        rp_survive_1(vertex->depth, rp_unit_1(light_bits.w), out);
}
#endif

#endif
