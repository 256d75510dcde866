// What happens at vertices of paths (scatter.cl), on RP_LANES lanes.
#include "common/begin_lanes.cl"
#include "common/vector_lanes.cl"

// A surface that a path has come to.
typedef struct RP_NAME(rp_vertex_) {
    RP_NAME(rp_vector_) direction;  // of the ray that came, unit
    RP_NAME(rp_vector_) throughput, position;
    RP_NAME(rp_vector_) reflectance;            // of a diffuse material
    RP_FLOATS offset;                           // how far from `position` rays begin
    RP_UINTS geometric_normal, shading_normal;  // octahedral
    RP_UINTS pixel, sample, depth;              // depth: scattering events before this one
    RP_INTS refraction;                         // abi/path.h
#ifdef RP_ANISOTROPIC
    RP_UINTS tangent;  // as rp_texture_place has it
#endif
#ifdef RP_SKY_PAGED
    RP_NAME(rp_vector_) sky;  // of the light that it connects to: what is to be multiplied to its radiance
#endif
} RP_NAME(rp_vertex_);

// The rays that leave it: a shadow ray, an extension ray, both or none.
typedef struct RP_NAME(rp_departure_) {
    RP_NAME(rp_vector_) start;  // of both
    RP_INTS shadow, go_on;
    RP_NAME(rp_vector_) light_direction, light;  // light: what arrives by the shadow ray, times throughput
    RP_FLOATS light_reach;
    RP_NAME(rp_vector_) direction, throughput;  // of the extension ray
    RP_FLOATS density;                          // of its direction, by solid angle; 0: specular
    RP_INTS refraction;                         // as rp_vertex has it, of the extension ray
} RP_NAME(rp_departure_);

// With the paper's roulette (3.3), half of the paths connect and end, the others go on without; each counts double. connects: this kind of
// surface can be lit by a light that was chosen. number: of the choice.
static inline void RP_NAME(rp_choose_rays_)(__constant rp_render_params* params, RP_INTS connects, RP_UINTS number, RP_NAME(rp_departure_)* out) {
    out->shadow = connects;
    out->go_on = (RP_INTS)(-1);
    if (params->roulette_connection == 0u) return;
    out->shadow = connects & (number < 0x80000000u);
    out->go_on = out->shadow == 0;
    out->throughput = RP_NAME(rp_times_)(out->throughput, connects ? (RP_FLOATS)(2.0f) : (RP_FLOATS)(1.0f));
}

// After the extension ray's weight is in its throughput: Russian roulette on that, without what refraction has changed and will change back when
// the path comes out again. Else paths end in glass for nothing, and what is left of its caustics is noise. number: in [0, 1).
static inline void RP_NAME(rp_survive_)(RP_UINTS depth, RP_FLOATS number, RP_NAME(rp_departure_)* out) {
    const RP_FLOATS largest = rp_max(rp_max(out->throughput.x, out->throughput.y), out->throughput.z);
    const RP_FLOATS unrefracted = largest * RP_AS_FLOATS(0x3f800000 + (out->refraction << 15));  // rp_refraction
    const RP_FLOATS survival = depth + 1u >= RP_ROULETTE_DEPTH ? rp_min(0.95f, RP_ROULETTE_SCALE * unrefracted) : (RP_FLOATS)(1.0f);
    out->go_on &= (largest > 0.0f) & (number < survival);
    out->throughput = RP_NAME(rp_times_)(out->throughput, survival > 0.0f ? 1.0f / survival : (RP_FLOATS)(0.0f));
}

// Random numbers of a vertex.
typedef struct RP_NAME(rp_scatter_numbers_) {
    RP_NAME(rp_numbers_) light, bsdf;
} RP_NAME(rp_scatter_numbers_);
static inline RP_NAME(rp_scatter_numbers_) RP_NAME(rp_scatter_numbers_of_)(__constant rp_render_params* params, const RP_NAME(rp_vertex_)* vertex) {
    const RP_NAME(rp_scatter_numbers_) numbers = {
        RP_NAME(rp_random_bits_)(vertex->pixel, vertex->sample, vertex->depth + 1u, RP_RANDOM_LIGHT, params->seed),
        RP_NAME(rp_random_bits_)(vertex->pixel, vertex->sample, vertex->depth + 1u, RP_RANDOM_BSDF, params->seed)};
    return numbers;
}

// The shadow ray from a diffuse surface to a light. reflected: throughput times reflectance.
static inline void RP_NAME(rp_connect_diffuse_)(const RP_NAME(rp_vertex_)* vertex, const RP_NAME(rp_frame_)* frame,
                                                const RP_NAME(rp_light_sample_)* light, RP_NAME(rp_vector_) reflected, RP_NAME(rp_departure_)* out) {
    const RP_INTS faces = RP_NAME(rp_dot_)(frame->normal, frame->view) > 0.0f;
    const RP_FLOATS cosine = RP_NAME(rp_dot_)(light->direction, frame->normal), density = cosine * RP_INV_PI;
    const RP_INTS lit = faces & (cosine > 0.0f) & (RP_NAME(rp_dot_)(light->direction, frame->geometric_normal) > 0.0f);
    const RP_FLOATS weight = light->density > 0.0f ? RP_NAME(rp_mis_weight_)(light->density, density) : (RP_FLOATS)(1.0f);
    out->light = RP_NAME(rp_times_)(RP_NAME(rp_product_)(reflected, light->radiance), density * weight);
#ifdef RP_SKY_PAGED
    out->light = RP_NAME(rp_product_)(out->light, vertex->sky);
#endif
    out->light_direction = light->direction;
    out->light_reach = light->reach;
    out->shadow &= lit & ((out->light.x > 0.0f) | (out->light.y > 0.0f) | (out->light.z > 0.0f));
}

// The extension ray from there.
static inline void RP_NAME(rp_leave_diffuse_)(const RP_NAME(rp_vertex_)* vertex, const RP_NAME(rp_frame_)* frame, RP_NAME(rp_numbers_) bits,
                                              RP_NAME(rp_vector_) reflected, RP_NAME(rp_departure_)* out) {
    const RP_INTS faces = RP_NAME(rp_dot_)(frame->normal, frame->view) > 0.0f;
    const RP_FLOATS u = RP_NAME(rp_unit_)(bits.x), r = sqrt(u);
    RP_FLOATS sine, cosine;
    RP_NAME(rp_sincos_turns_)(RP_NAME(rp_unit_)(bits.y), &sine, &cosine);
    const RP_NAME(rp_vector_) upward = {r * cosine, r * sine, sqrt(1.0f - u)};
    const RP_NAME(rp_vector_) direction = RP_NAME(rp_to_world_)(frame, upward);
    out->direction = RP_NAME(rp_times_)(direction, rp_rsqrt(RP_NAME(rp_dot_)(direction, direction)));
    out->density = upward.z * RP_INV_PI;
    out->throughput = reflected;
    out->refraction = vertex->refraction;
    out->go_on &= faces & (upward.z > 0.0f) & (RP_NAME(rp_dot_)(out->direction, frame->geometric_normal) > 0.0f);
}

#include "common/end_lanes.cl"
