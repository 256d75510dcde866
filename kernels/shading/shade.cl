// Fourth stage: at the end of an extension ray. Adds what the surface or the background emits, and sends a shadow ray and the next extension
// ray on their way (shading/scatter.cl). With RP_SHADE_LANES = 16, for CPUs, vertices on diffuse surfaces are seen to sixteen at a time.
#include "common/noinline.cl"
#include "common/end_path.cl"
#include "common/primitive_ranges.cl"
#include "common/queue.cl"
#include "shading/scatter.cl"
#include "shading/surface.cl"
#ifdef RP_TRAITS
#include "shading/instance_traits.cl"
#endif
#ifdef RP_TEXTURES
#include "shading/texture.cl"
#endif
#ifdef RP_SKY_PAGED
#include "shading/paged_sky.cl"
#endif
#include "shading/film_layers.cl"
#include "shading/mixes.cl"

static inline float3 rp_background(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                   float3 direction, float bsdf_density, bool full) {
    if (params->infinite_light == RP_NONE) return (float3)(0.0f);
    const __global rp_light* light = lights + params->infinite_light;
#ifdef RP_SKY
    const __global uint* sky = rp_sky_words(light, light_steps);
    const float2 place = rp_sky_place(rp_sky_from_world(light, direction));
    return rp_sky_radiance(sky, place) * (full ? 1.0f : rp_mis_weight_1(bsdf_density, light->probability * rp_sky_density(sky, place)));
#else
    const float weight = full ? 1.0f : rp_mis_weight_1(bsdf_density, light->probability * (0.25f * RP_INV_PI));
    return rp_light_radiance(light) * weight;
#endif
}

// The light with this number at the end of a ray. position: there.
static inline float3 rp_emission(const __global rp_light* lights, const __global uint* light_steps, uint number, float3 position, float3 normal,
                                 float3 direction, float distance, float bsdf_density, bool full) {
    const __global rp_light* light = lights + number;
#ifdef RP_LIGHT_TREE
    // Where the ray began is not kept in every form of its planes; and what is not exactly the same would show how it was traced.
    const float3 before = position - distance * direction;
    const float chance = full ? 1.0f : fmax(rp_light_chance(light_steps, before, number), 0x1p-64f);
#else
    const float chance = light->probability;
#endif
    const float light_density = rp_light_density(light, chance, normal, direction, distance);
    if (light_density < 0.0f) return (float3)(0.0f);
    return rp_light_radiance(light) * (full ? 1.0f : rp_mis_weight_1(bsdf_density, light_density));
}

// Slots that are to be shaded: those of the extension rays of this round, of which some wait, and with textures, from the end of the free list on,
// those whose page has come.
typedef struct rp_shade_queue {
    const __global uint* rays;
#ifdef RP_TEXTURES
    const __global uint* resumed;
#endif
    uint arrived;  // how many the former are
#ifdef RP_TEXTURES
    uint slot_count;
#endif
} rp_shade_queue;
static inline uint rp_shade_entry(const rp_shade_queue* queue, uint i) {
#ifdef RP_TEXTURES
    if (i >= queue->arrived) return rp_textured_entry(queue->resumed, queue->slot_count, i - queue->arrived);
#endif
    return rp_extend_entry(queue->rays, i);
}

// A path ends here. Called in one place as far as can be: adding a sample takes much code.
static inline void rp_end_path(__constant rp_render_params* params, const rp_paths* paths, uint slot, __global uint* film, uint pixel,
                               float3 radiance) {
    rp_add_sample(params, paths, slot, film, pixel, radiance);
    rp_free_slot(paths, slot);
}

// What becomes of a path.
#define RP_OUTCOME_SCATTERS 0u  // at the surface that it has come to
#define RP_OUTCOME_ENDS 1u      // its radiance is known
#define RP_OUTCOME_GOES_ON 2u   // its next ray, or what it waits for, is in its slot

// A path that has come to a surface from which it may go on; of one that ends, slot, radiance and the pixel alone. status: of its slot when it came.
typedef struct rp_reached_vertex {
    uint slot, status;
#if defined(RP_TEXTURES) || defined(RP_TRAITS)
    rp_material own;  // as its textures, or its instance, have it here; of a diffuse one no more than kind, flags and colour
#endif
    RP_MATERIAL_SPACE const rp_material* material;
    float3 radiance;
    rp_vertex_1 vertex;
} rp_reached_vertex;

#ifdef RP_SHORT_STATES
#if RP_SHADE_LANES == 16
#error "streams find surfaces themselves"
#endif
// Finds the surface at the hit of a path that has come there.
static inline void rp_find_surface(const rp_geometry* geometry, rp_arrival* a) {
    const rp_ray ray = rp_make_ray(a->origin, a->direction);
    const rp_hit hit = {a->distance, a->leaf, a->block};
    const rp_surface s = rp_hit_surface(geometry, &ray, &hit);
    a->position = s.position;
    a->geometric_normal = s.geometric_normal;
    a->shading_normal = s.shading_normal;
    a->offset_exponent = s.offset_exponent;
#ifdef RP_VERTEX_COLORS
    a->color = s.color;
#endif
#ifdef RP_UVS
    a->uv = s.uv;
    a->density = s.density;
#ifdef RP_TANGENTS
    a->tangent = s.tangent;
#endif
#endif
}
#endif

// What beside paths shading takes: textures, or where it finds surfaces geometry.
#ifdef RP_TEXTURES
#ifdef RP_SHORT_STATES
#define RP_SHADE_TREE RP_GEOMETRY_PARAMETERS
#else
#define RP_SHADE_TREE RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top
#endif
#define RP_SHADE_PARAMETERS \
    RP_SHADE_TREE, uint block_count, uint round, const __global uint *restrict texture_words, const __global uint *restrict free_list,
#define RP_SHADE_GEOMETRY const rp_textures *textures,
#define RP_SHADE_FROM textures,
#define RP_SHADE_GEOMETRY_OF textures->geometry
#elif defined(RP_SHORT_STATES)
#define RP_SHADE_PARAMETERS RP_GEOMETRY_PARAMETERS, uint block_count,
#define RP_SHADE_GEOMETRY const rp_geometry *geometry,
#define RP_SHADE_FROM geometry,
#define RP_SHADE_GEOMETRY_OF geometry
#else
#define RP_SHADE_PARAMETERS
#define RP_SHADE_GEOMETRY
#define RP_SHADE_FROM
#endif

#ifdef RP_TEXTURES
#include "shading/found_material.cl"
#endif

#ifdef RP_CUTOUTS
// The ray of a path that has arrived passes what is there.
static inline void rp_pass(const rp_paths* paths, uint slot, uint status, const rp_arrival* a) {
    const float3 normal = rp_decode_normal(a->geometric_normal);
    const float beyond = rp_offset_distance(a->offset_exponent);
    rp_pass_through(paths, slot, status, a, a->position + (dot(normal, a->direction) < 0.0f ? -beyond : beyond) * normal);
}

// The shadow ray of a path has come to its end.
static inline uint rp_end_shadow(const rp_paths* paths, uint status, const rp_arrival* a, bool occluded, rp_reached_vertex* reached) {
    return rp_end_shadow_as_extension(paths, reached->slot, status, a, occluded, &reached->radiance) ? RP_OUTCOME_GOES_ON : RP_OUTCOME_ENDS;
}
#endif

// Adds what shines at the end of a ray.
static inline uint rp_arrive(RP_SHADE_GEOMETRY __constant rp_render_params* params, const __global rp_material* materials,
                             const __global rp_light* lights, const __global uint* light_steps, const __global rp_primitive_range* ranges,
                             const rp_paths* paths, uint slot, uint status, bool resumed, __global uint* film, rp_reached_vertex* reached) {
#ifdef RP_SHORT_STATES
    __constant rp_camera* camera = &params->camera;
    rp_arrival a = rp_arrival_of(paths, slot, status, (float3)(camera->eye[0], camera->eye[1], camera->eye[2]));
    if (a.block != RP_NONE) {
        const rp_hit hit = {a.distance, a.leaf, a.block};
        a.primitive = rp_hit_primitive(RP_SHADE_GEOMETRY_OF, &hit);
#ifdef RP_CUTOUTS
        // Of what stops a shadow ray for good nothing else is asked.
        if (!a.shadow || rp_may_be_nothing(ranges, params->range_count, a.primitive))
#endif
            rp_find_surface(RP_SHADE_GEOMETRY_OF, &a);
    }
#else
    const rp_arrival a = rp_arrival_of(paths, slot, status);
#endif
    float3 radiance = a.radiance;
    const uint depth = rp_depth_of(a.flags), pixel = a.pixel;
    reached->slot = slot;
    reached->vertex.pixel = pixel;
    const bool full_emission = rp_was_specular(a.flags);

    const __global rp_primitive_range* range = ranges;
    if (a.primitive != RP_NONE) range += rp_find_range(ranges, params->range_count, a.primitive);
#ifdef RP_CUTOUTS
    const bool cut_out = a.primitive != RP_NONE && (range->flags & RP_RANGE_CUTOUT) != 0u;
    if (a.shadow && !cut_out) return rp_end_shadow(paths, status, &a, a.primitive != RP_NONE, reached);
#endif
    if (a.primitive == RP_NONE) {
        if (depth == 0u && params->background_kind != RP_BACKGROUND_LIGHTS) {
            if (params->background_kind == RP_BACKGROUND_TRANSPARENT) rp_film_add_miss(rp_film_pixel(params, film, pixel));
            reached->radiance = (float3)(params->background[0], params->background[1], params->background[2]);
            return RP_OUTCOME_ENDS;
        }
#ifdef RP_SKY_PAGED
        float3 seen;
        uint absent;
        if (!rp_see_sky(textures, params, &a, &seen, &absent)) {
            rp_await_page(textures, paths, slot, rp_wait_to_shade(paths, slot, status, &a, 0u), absent);
            return RP_OUTCOME_GOES_ON;
        }
#else
        const float3 seen = rp_background(params, lights, light_steps, a.direction, a.bsdf_density, full_emission);
#endif
        reached->radiance = radiance + a.throughput * seen;
        return RP_OUTCOME_ENDS;
    }
#ifdef RP_TRAITS
    const __global rp_instance_traits* const traits = rp_traits_numbered(ranges, params->range_count, a.traits);
    const uint material_number = rp_traits_material(traits, range->material);
#else
    const uint material_number = range->material;
#endif
#ifdef RP_TEXTURES
    uint shading_normal = a.shading_normal;
#ifdef RP_FIRST_HIT_LAYERS
    bool look = depth < params->max_depth || depth == 0u;
#else
    bool look = depth < params->max_depth;
#endif
#ifdef RP_CUTOUTS
    look = look || cut_out;
#endif
    if (look) {
        const int found = rp_find_material(textures, params, materials, material_number, &a, paths, slot, status, resumed, &reached->own,
#ifdef RP_SKY_PAGED
                                           &reached->vertex.sky,
#endif
                                           &shading_normal);
#ifdef RP_CUTOUTS
        if (found == RP_FOUND_NOTHING) rp_pass(paths, slot, status, &a);
#endif
        if (found != RP_FOUND_MATERIAL) return RP_OUTCOME_GOES_ON;
    }
#else
    const uint shading_normal = a.shading_normal;
#endif
#ifdef RP_CUTOUTS
    if (a.shadow) return rp_end_shadow(paths, status, &a, true, reached);
    const float distance = a.passed + a.distance;  // from the vertex
#else
    const float distance = a.distance;
#endif
    if (range->first_light != RP_NONE) {
        uint number = range->first_light + (a.primitive - range->first_primitive);
#ifdef RP_TRAITS
        number = rp_traits_light(traits, number);
#endif
        // Of a damaged scene it may be any.
        if (number < params->light_count)
            radiance += a.throughput * rp_emission(lights, light_steps, number, a.position, rp_decode_normal(a.geometric_normal), a.direction,
                                                   distance, a.bsdf_density, full_emission);
    }
    reached->radiance = radiance;
    const bool ends = depth >= params->max_depth;
#ifdef RP_FIRST_HIT_LAYERS
    if (ends && depth > 0u) return RP_OUTCOME_ENDS;
#else
    if (ends) return RP_OUTCOME_ENDS;
#endif
#ifdef RP_TEXTURES
    const rp_material* material = &reached->own;
#elif defined(RP_LAYERED)
    const __global rp_material* given = rp_of_mix(params, materials, material_number, pixel, a.sample, depth);
#else
    const __global rp_material* given = materials + material_number;
#endif
#if defined(RP_TRAITS) && !defined(RP_TEXTURES)
    reached->own = *given;
    const rp_material* material = &reached->own;
#elif !defined(RP_TEXTURES)
    const __global rp_material* material = given;
#endif
    const bool colored = (range->flags & RP_RANGE_POINT_COLOR) != 0u, plain = (material->flags & RP_MATERIAL_PLAIN) != 0u;
    const float3 root = (float3)(a.shading_normal >> 8 & 255u, a.shading_normal >> 16 & 255u, a.shading_normal >> 24) / 255.0f;
    float3 reflectance = colored && !plain ? root * root : (float3)(material->color[0], material->color[1], material->color[2]);
#ifdef RP_VERTEX_COLORS
    if ((range->flags & RP_RANGE_VERTEX_COLOR) && !plain) reflectance = rp_blended_reflectance(a.color);
#endif
#ifdef RP_TRAITS
    const float3 color = rp_traits_color(traits);
    reflectance *= color;
    if (material->kind != RP_MATERIAL_DIFFUSE) {
        reached->own.transmittance[0] *= color.x;
        reached->own.transmittance[1] *= color.y;
        reached->own.transmittance[2] *= color.z;
    }
#endif
    reached->status = status;
    reached->material = material;
    rp_vertex_1* vertex = &reached->vertex;
    vertex->direction = rp_vector_of(a.direction);
    vertex->throughput = rp_vector_of(a.throughput);
    vertex->position = rp_vector_of(a.position);
    vertex->reflectance = rp_vector_of(reflectance);
    vertex->offset = rp_offset_distance(a.offset_exponent);
    vertex->geometric_normal = a.geometric_normal;
    vertex->shading_normal = colored ? a.geometric_normal : shading_normal;
    vertex->sample = a.sample;
    vertex->depth = depth;
    vertex->refraction = rp_refraction_of(a.flags);
#ifdef RP_ANISOTROPIC
#ifdef RP_TANGENTS
    vertex->tangent = a.tangent;
#else
    vertex->tangent = RP_NONE;
#endif
#endif
#ifdef RP_FIRST_HIT_LAYERS
    if (depth == 0u) {
#if defined(RP_HIT_IDS) && defined(RP_INSTANCES)
        const uint2 ids = rp_ids_of(paths, slot);
#else
        const uint2 ids = (uint2)(0u);
#endif
        rp_keep_first_hit(rp_film_pixel(params, film, pixel), &params->camera, paths, slot, vertex, material, distance, ids, material_number);
        if (ends) return RP_OUTCOME_ENDS;
    }
#endif
    return RP_OUTCOME_SCATTERS;
}

// The rays that leave a vertex; the path ends if there is none. status: of the slot so far. mine: counts of bounce rays and shadow rays.
static inline uint rp_depart(const rp_paths* paths, uint slot, uint status, float3 radiance, uint pixel, uint sample, uint depth,
                             const rp_departure_1* out, uint* mine) {
    if (!out->shadow && !out->go_on) return RP_OUTCOME_ENDS;
    const bool specular = out->go_on && out->density == 0.0f;
#ifdef RP_TEXTURES
    // What is scattered spreads (bench/journal/textures.md); what is mirrored or refracted goes on as it came.
    if (out->go_on && !specular) {
        rp_cone cone = rp_cone_of(paths, slot);
        cone.spread = rp_max(cone.spread, rp_min(0.5f, 0.35f / sqrt(out->density)));
        rp_set_cone(paths, slot, cone);
    }
#endif
    const float3 direction = out->go_on ? rp_float3(out->direction) : (float3)(0.0f);
    const float density = out->go_on ? out->density : 0.0f;
    rp_store_throughput_and_radiance(paths, slot, rp_float3(out->throughput), rp_path_flags(depth + 1u, specular, out->go_on ? out->refraction : 0),
                                     radiance, pixel);
#ifdef RP_CUTOUTS
    if (!out->shadow) rp_set_passed(paths, slot, 0.0f);
#endif
    if (out->shadow)
        rp_begin_shadow(paths, slot, status, depth, rp_float3(out->start), rp_float3(out->light_direction), out->light_reach, rp_float3(out->light),
                        !out->go_on, direction, density, sample);
    else
        rp_begin_extension(paths, slot, status, depth, rp_float3(out->start), direction, density, sample);
    mine[0] += out->go_on ? 1u : 0u;
    mine[1] += out->shadow ? 1u : 0u;
    return RP_OUTCOME_GOES_ON;
}

static inline uint rp_shade_one(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                const rp_reached_vertex* reached, const rp_paths* paths, uint* mine) {
    const rp_vertex_1* vertex = &reached->vertex;
    rp_departure_1 out;
    rp_scatter_1(params, lights, light_steps, reached->material, vertex, &out);
    return rp_depart(paths, reached->slot, reached->status, reached->radiance, vertex->pixel, vertex->sample, vertex->depth, &out, mine);
}

#if RP_SHADE_LANES == 16
#include "shading/shade_gathered.cl"
#endif

// Intel's compiler for CPUs makes vectors of work-items, and crashes over it where materials have layers, for instance. Not where it is told that
// there are vectors already.
#ifdef RP_NV_PTX
#define RP_NO_MORE_VECTORS
#else
#define RP_NO_MORE_VECTORS __attribute__((vec_type_hint(float16)))
#endif

__kernel RP_NO_MORE_VECTORS void rp_shade(RP_SHADE_PARAMETERS __constant rp_render_params* restrict params,
                                          const __global rp_material* restrict materials, const __global rp_light* restrict lights,
                                          const __global uint* restrict light_steps, const __global rp_primitive_range* restrict ranges,
                                          const __global uint* restrict queue, __global uint* restrict status, __global uint4* restrict planes,
                                          volatile __global uint* restrict counters, __global uint* restrict film) {
    const rp_paths paths = {params->slot_count, status, planes};
    __local uint totals[2];
    uint mine[2] = {0u, 0u};
    rp_begin_totals(totals, 2u);
#if defined(RP_TEXTURES) || defined(RP_SHORT_STATES)
    const rp_geometry geometry_of_scene = RP_MAKE_GEOMETRY(block_count);
    const rp_geometry* const geometry = &geometry_of_scene;
#endif
#ifdef RP_TEXTURES
    const rp_textures all_textures = {geometry, texture_words, &params->textures, demand, counters, block_count, round,
#ifdef RP_SKY_PAGED
                                      lights,   light_steps
#endif
    };
    const rp_textures* const textures = &all_textures;
    const rp_shade_queue all = {queue, free_list, counters[RP_COUNT_EXTEND], params->slot_count};
    const uint count = counters[RP_COUNT_EXTEND] + counters[RP_COUNT_TEXTURED];
#else
    const rp_shade_queue all = {queue, counters[RP_COUNT_EXTEND]};
    const uint count = counters[RP_COUNT_EXTEND];
#endif
#if RP_SHADE_LANES == 16
    const uint item = (uint)get_global_id(0), step = (uint)get_global_size(0);
    rp_shade_runs(RP_SHADE_FROM item, step, count, params, materials, lights, light_steps, ranges, all, paths, film, mine);
#else
    rp_reached_vertex reached;
    for (uint i = get_global_id(0); i < count; i += get_global_size(0)) {
        const uint slot = rp_shade_entry(&all, i), status = rp_status_of(&paths, slot);
        const bool resumed = i >= all.arrived;
        if (!rp_is_to_shade(status) && !resumed) continue;
        uint outcome = rp_arrive(RP_SHADE_FROM params, materials, lights, light_steps, ranges, &paths, slot, status, resumed, film, &reached);
        if (outcome == RP_OUTCOME_SCATTERS) outcome = rp_shade_one(params, lights, light_steps, &reached, &paths, mine);
        if (outcome == RP_OUTCOME_ENDS) rp_end_path(params, &paths, slot, film, reached.vertex.pixel, reached.radiance);
    }
#endif
    rp_add_totals(totals, mine, 2u, counters + RP_COUNT_BOUNCE_RAYS);
}
