// What happens at a vertex of a path: it connects to a light (the shadow ray is traced by the stage `connect`), and scatters. Next-event estimation
// and BSDF sampling are combined by multiple importance sampling (Veach 1997), as in pbrt's path integrator (Pharr, Jakob, Humphreys 2023,
// chapter 13.4).
#ifndef RP_SCATTER_CL
#define RP_SCATTER_CL

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

#ifdef RP_ANISOTROPIC
// Turns the frame at a vertex to where roughness has a direction: to the way in which u grows, made perpendicular to the normal (as in pbrt, Pharr,
// Jakob, Humphreys 2023, chapter 3.10); on a sphere around its axis. Where neither says anything, the geometric normal decides.
static inline void rp_turn_frame(RP_MATERIAL_SPACE const rp_material* material, const rp_vertex_1* vertex, rp_frame_1* frame) {
    const float3 n = rp_float3(frame->normal);
    float3 along;
    if (vertex->tangent != RP_NONE)
        along = rp_decode_normal(vertex->tangent);
    else if (RP_SPHERE_AXIS(*material) != 0u)
        along = cross(rp_decode_normal(~RP_SPHERE_AXIS(*material)), rp_float3(frame->geometric_normal));
    else
        along = rp_float3(rp_make_frame_1(vertex->direction, vertex->geometric_normal, vertex->geometric_normal).tangent);
    along -= dot(along, n) * n;
    const float length2 = dot(along, along);
    if (length2 < 1e-12f) return;
    along /= sqrt(length2);
    frame->tangent = rp_vector_of(along);
    frame->bitangent = rp_vector_of(cross(n, along));
}
#endif

static inline float4 rp_units(rp_numbers_1 bits) { return (float4)(rp_unit_1(bits.x), rp_unit_1(bits.y), rp_unit_1(bits.z), rp_unit_1(bits.w)); }

#if RP_SHADE_LANES == 16
// Sixteen vertices on diffuse surfaces.
static inline void rp_scatter_diffuse_16(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                         const rp_vertex_16* vertex, rp_departure_16* out) {
    const rp_scatter_numbers_16 numbers = rp_scatter_numbers_of_16(params, vertex);
    const rp_frame_16 frame = rp_make_frame_16(vertex->direction, vertex->geometric_normal, vertex->shading_normal);
    out->start = rp_plus_16(vertex->position, rp_times_16(frame.geometric_normal, vertex->offset));
    out->throughput = vertex->throughput;
    rp_choose_rays_16(params, (int16)(params->light_count != 0u ? -1 : 0), numbers.bsdf.w, out);
    const rp_vector_16 reflected = rp_product_16(out->throughput, vertex->reflectance);
    const rp_vector_16 none = {(float16)(0.0f), (float16)(0.0f), (float16)(0.0f)};
    out->light = out->light_direction = none;
    out->light_reach = (float16)(0.0f);
    if (any(out->shadow)) {
        const rp_light_sample_16 light = rp_sample_light_16(lights, light_steps, params->light_count, out->start, frame.normal, numbers.light);
        rp_connect_diffuse_16(vertex, &frame, &light, reflected, out);
    }
    rp_leave_diffuse_16(vertex, &frame, numbers.bsdf, reflected, out);
    rp_survive_16(vertex->depth, rp_unit_16(numbers.light.w), out);
}
#endif

// One vertex, of any material; with RP_SHADE_LANES = 16 of any that is not diffuse. What all materials need is done by all together: the work-items
// of a GPU part less often, and its code is there once.
static inline void rp_scatter_1(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                RP_MATERIAL_SPACE const rp_material* material, const rp_vertex_1* vertex, rp_departure_1* out) {
    const rp_scatter_numbers_1 numbers = rp_scatter_numbers_of_1(params, vertex);
    const rp_numbers_1 bits = numbers.bsdf;
    rp_frame_1 frame = rp_make_frame_1(vertex->direction, vertex->geometric_normal, vertex->shading_normal);
#if RP_SHADE_LANES == 16
    const bool diffuse = false;
#else
    const bool diffuse = material->kind == RP_MATERIAL_DIFFUSE;
#endif
#ifdef RP_ANISOTROPIC
    if (!diffuse && rp_is_anisotropic(material)) rp_turn_frame(material, vertex, &frame);
#endif
    float offset = vertex->offset;
    bool single = !diffuse && rp_is_specular(material), connects = !single;  // single: all it scatters goes in single directions
#ifdef RP_LAYERED
    const bool layered = material->kind == RP_MATERIAL_LAYERED;
    rp_layers layers;
    if (layered) {
        layers = rp_choose_layers(material, &frame, rp_float3(vertex->reflectance), rp_unit_1(bits.z));
        if (layers.below) offset = -offset;
        single = layers.single >= 1.0f;
        connects = layers.side > 0.0f && !single;
    }
#endif
    const rp_vector_1 away = rp_times_1(frame.geometric_normal, offset);
    out->start = rp_plus_1(vertex->position, away);
    out->throughput = vertex->throughput;
    rp_choose_rays_1(params, params->light_count != 0u && connects, bits.w, out);
    const rp_vector_1 reflected = rp_product_1(out->throughput, vertex->reflectance);  // where it is diffuse
    if (out->shadow) {
        const rp_vector_1 all_around = {0.0f, 0.0f, 0.0f};
        const rp_light_sample_1 light =
            rp_sample_light_1(lights, light_steps, params->light_count, out->start, diffuse ? frame.normal : all_around, numbers.light);
        if (diffuse)
            rp_connect_diffuse_1(vertex, &frame, &light, reflected, out);
        else {
            float density;
#ifdef RP_LAYERED
            const float3 scattered = layered ? rp_layers_evaluate(material, &frame, &layers, rp_float3(light.direction), &density)
                                             : rp_bsdf_evaluate(material, &frame, rp_float3(light.direction), &density);
#else
            const float3 scattered = rp_bsdf_evaluate(material, &frame, rp_float3(light.direction), &density);
#endif
            rp_connect_to_light(vertex, &light, scattered, density, out);
        }
    }
    if (!out->go_on) return;
    if (diffuse)
        rp_leave_diffuse_1(vertex, &frame, bits, reflected, out);
    else {
#ifdef RP_LAYERED
        const rp_scatter scatter = layered ? rp_layers_sample(material, &frame, &layers, (float4)(rp_unit_1(bits.x), rp_unit_1(bits.y), 0.0f, 0.0f))
                                           : rp_bsdf_sample(material, &frame, rp_units(bits));
        const bool crosses = scatter.transmitted && !layered;
        const int change = layered ? rp_refraction(layers.eta) : frame.back_facing ? -rp_refraction(material->ior) : rp_refraction(material->ior);
#else
        const rp_scatter scatter = rp_bsdf_sample(material, &frame, rp_units(bits));
        const bool crosses = scatter.transmitted;
        const int change = frame.back_facing ? -rp_refraction(material->ior) : rp_refraction(material->ior);
#endif
        out->direction = rp_vector_of(scatter.direction);
        out->density = scatter.density;
        out->throughput = rp_product_1(out->throughput, rp_vector_of(scatter.weight));
        out->refraction =
            scatter.transmitted ? clamp(vertex->refraction + change, -RP_PATH_MAX_REFRACTION, RP_PATH_MAX_REFRACTION) : vertex->refraction;
        // Both rays of a vertex begin at the same point: only specular scattering leaves on the other side, and it has no shadow ray.
        if (crosses) out->start = rp_minus_1(vertex->position, away);
    }
    // Specular surfaces make no connection: what comes next is all that a path brings from there. But one between mirrors ends some day.
    if (single && vertex->depth < RP_MAX_SPARED)
        out->go_on = out->throughput.x > 0.0f || out->throughput.y > 0.0f || out->throughput.z > 0.0f;
    else
        rp_survive_1(vertex->depth, rp_unit_1(numbers.light.w), out);
}

#endif
