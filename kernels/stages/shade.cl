// Fourth stage: at the end of an extension ray. Adds what the surface or the background emits, and sends a shadow ray and the next extension
// ray on their way (lib/scatter.cl). With RP_SHADE_LANES = 16, for CPUs, vertices on diffuse surfaces are seen to sixteen at a time.
#include "lib/apart.cl"
#include "lib/film.cl"
#include "lib/path.cl"
#include "lib/scatter.cl"
#include "lib/surface.cl"

// The range that primitive belongs to.
static inline uint rp_find_range(const __global rp_primitive_range* ranges, uint count, uint primitive) {
    uint low = 0u, high = count - 1u;
    while (low < high) {
        const uint middle = (low + high + 1u) >> 1u;
        if (ranges[middle].first_primitive <= primitive) low = middle;
        else high = middle - 1u;
    }
    return low;
}

static inline float3 rp_background(__constant rp_render_params* params, const __global rp_light* lights, float bsdf_density, bool full) {
    if (params->infinite_light == RP_NONE) return (float3)(0.0f);
    const __global rp_light* light = lights + params->infinite_light;
    const float weight = full ? 1.0f : rp_mis_weight_1(bsdf_density, light->probability * (0.25f * RP_INV_PI));
    return rp_light_radiance(light) * weight;
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

static inline void rp_finish(__constant rp_render_params* params, __global uint* status, uint slot, __global uint* film, uint pixel, float3 radiance) {
    rp_film_add(film, pixel, rp_film_limit(radiance, params->max_luminance, params->max_xyz));
    status[slot] = RP_STATUS_FREE;
}

// What the planes hold at the end of an extension ray.
typedef struct rp_arrival_planes {
    uint4 origin, direction, throughput, radiance, hit, surface;
#ifdef RP_VERTEX_COLORS
    uint color;
#endif
} rp_arrival_planes;

// A path that has come to a surface from which it may go on.
typedef struct rp_arrival {
    uint slot, state;
    const __global rp_material* material;
    float3 radiance;
    rp_vertex_1 vertex;
} rp_arrival;

#if defined(RP_SHORT_STATES) && RP_SHADE_LANES == 16
#error "streams find surfaces themselves"
#endif
#ifdef RP_SHORT_STATES
// Brings the planes of a path into the form that abi/path.h gives first, the surface at the hit included. state: of its slot.
static inline void rp_unfold(const rp_geometry* geometry, __constant rp_camera* camera, rp_arrival_planes* p, uint* state) {
    uint3 found = p->hit.xyz;
    if (*state & RP_STATUS_CAMERA) {
        p->throughput = (uint4)(as_uint3((float3)(1.0f)), RP_PATH_SPECULAR);
        p->radiance = (uint4)((uint3)(0u), p->origin.w);
        p->surface = (uint4)(0u, 0u, p->direction.w, RP_NONE);
        p->hit.w = RP_NONE;
        p->direction.w = as_uint(0.0f);
        found = p->origin.xyz;
        p->origin.xyz = as_uint3((float3)(camera->eye[0], camera->eye[1], camera->eye[2]));
    } else if (*state & RP_STATUS_CONNECTED) {
        if (*state & RP_STATUS_LIT) p->radiance.xyz = as_uint3(as_float3(p->radiance.xyz) + rp_light_in(p->hit, p->surface));
        found = p->direction.xyz;
        p->direction.xyz = p->hit.xyz;
        p->hit.w = RP_NONE;
    }
    if (!(*state & RP_STATUS_FOUND)) return;
    const rp_ray ray = rp_make_ray(as_float3(p->origin.xyz), as_float3(p->direction.xyz));
    const rp_hit hit = {as_float(found.z), found.x, found.y};
    const rp_surface s = rp_hit_surface(geometry, &ray, &hit);
    p->origin.w = found.z;
    p->hit = (uint4)(as_uint3(s.position), rp_hit_primitive(geometry, &hit));
    p->surface.xy = (uint2)(s.geometric_normal, s.shading_normal);
#ifdef RP_VERTEX_COLORS
    p->color = s.color;
#endif
    *state = RP_STATUS_SHADE | s.offset_exponent << RP_STATUS_OFFSET_SHIFT;
}
#define RP_SHADE_PARAMETERS RP_GEOMETRY_PARAMETERS, uint block_count,
#define RP_SHADE_GEOMETRY const rp_geometry* geometry,
#define RP_SHADE_FROM &geometry,
#define RP_SHADE_KEEPS 0u
#define RP_SHADE_FIRST(depth) ((depth) == 0u ? RP_STATUS_FIRST : 0u)
#else
// Brings the planes of a ray that is CONNECTED, and was traced in a stream, into the form that abi/path.h gives first. state: of its slot.
static inline void rp_unfold_connection(rp_arrival_planes* p, uint state) {
    const float3 before = as_float3(p->radiance.xyz), after = before + rp_light_in(p->hit, p->surface);
    p->radiance.xyz = as_uint3(state & RP_STATUS_LIT ? after : before);
    const uint4 hit = p->origin, surface = p->direction;
    p->origin.w = surface.z;
    p->direction = (uint4)(p->hit.xyz, surface.w);
    p->hit = hit;
    p->surface.xy = surface.xy;
}
#define RP_SHADE_PARAMETERS
#define RP_SHADE_GEOMETRY
#define RP_SHADE_FROM
#define RP_SHADE_KEEPS RP_STATUS_BLOCK_MASK  // of the status word
#define RP_SHADE_FIRST(depth) 0u
#endif

// Adds what shines at the end of a ray. False: the path has ended.
static inline bool rp_arrive(RP_SHADE_GEOMETRY __constant rp_render_params* params, const __global rp_material* materials,
                             const __global rp_light* lights, const __global uint* light_steps,
                             const __global rp_primitive_range* ranges, uint slot, uint state, __global uint* status, __global uint4* paths,
                             __global uint* film, rp_arrival* arrival) {
    const uint slot_count = params->slot_count;
    rp_arrival_planes p;
    p.origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot);
    p.direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot);
#ifdef RP_SHORT_STATES
    p.throughput = p.radiance = p.hit = p.surface = (uint4)(0u);
    if (!(state & RP_STATUS_CAMERA))
#endif
    {
        p.throughput = RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot_count, slot);
        p.radiance = RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot);
        p.hit = RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot);
        p.surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot);
    }
#ifdef RP_VERTEX_COLORS
    p.color = rp_color_of(status, slot_count, slot);
#endif
#ifdef RP_SHORT_STATES
    rp_unfold(geometry, &params->camera, &p, &state);
#else
    if (state & RP_STATUS_CONNECTED) rp_unfold_connection(&p, state);
#endif
    const float3 direction = as_float3(p.direction.xyz), throughput = as_float3(p.throughput.xyz);
    const float bsdf_density = as_float(p.direction.w);
    float3 radiance = as_float3(p.radiance.xyz);
    const uint flags = p.throughput.w, depth = flags & RP_PATH_DEPTH_MASK, pixel = p.radiance.w;
    const bool full_emission = (flags & RP_PATH_SPECULAR) != 0u;

    if (p.hit.w == RP_NONE) {
        if (depth == 0u && params->background_kind != RP_BACKGROUND_LIGHTS) {
            if (params->background_kind == RP_BACKGROUND_TRANSPARENT) rp_film_add_miss(film, pixel);
            rp_finish(params, status, slot, film, pixel, (float3)(params->background[0], params->background[1], params->background[2]));
            return false;
        }
        rp_finish(params, status, slot, film, pixel, radiance + throughput * rp_background(params, lights, bsdf_density, full_emission));
        return false;
    }
    const __global rp_primitive_range* range = ranges + rp_find_range(ranges, params->range_count, p.hit.w);
    if (range->first_light != RP_NONE) {
        const uint number = range->first_light + (p.hit.w - range->first_primitive);
        radiance += throughput * rp_emission(lights, light_steps, number, as_float3(p.hit.xyz), rp_decode_normal(p.surface.x), direction,
                                             as_float(p.origin.w), bsdf_density, full_emission);
    }
    if (depth >= params->max_depth) {
        rp_finish(params, status, slot, film, pixel, radiance);
        return false;
    }
    const __global rp_material* material = materials + range->material;
    const bool colored = (range->flags & RP_RANGE_POINT_COLOR) != 0u, plain = (material->flags & RP_MATERIAL_PLAIN) != 0u;
    const float3 root = (float3)(p.surface.y >> 8 & 255u, p.surface.y >> 16 & 255u, p.surface.y >> 24) / 255.0f;
    float3 reflectance = colored && !plain ? root * root : (float3)(material->color[0], material->color[1], material->color[2]);
#ifdef RP_VERTEX_COLORS
    if ((range->flags & RP_RANGE_VERTEX_COLOR) && !plain) reflectance = rp_blended_reflectance(p.color);
#endif
    arrival->slot = slot;
    arrival->state = state;
    arrival->material = material;
    arrival->radiance = radiance;
    rp_vertex_1* vertex = &arrival->vertex;
    vertex->direction = rp_vector_of(direction);
    vertex->throughput = rp_vector_of(throughput);
    vertex->position = rp_vector_of(as_float3(p.hit.xyz));
    vertex->reflectance = rp_vector_of(reflectance);
    vertex->offset = rp_offset_distance(rp_state_offset(state));
    vertex->geometric_normal = p.surface.x;
    vertex->shading_normal = colored ? p.surface.x : p.surface.y;
    vertex->pixel = pixel;
    vertex->sample = p.surface.z;
    vertex->depth = depth;
    vertex->refraction = (int)flags >> RP_PATH_REFRACTION_SHIFT;
    return true;
}

// The rays that leave a vertex; the path ends if there is none. state: of the slot so far. mine: counts of bounce rays and shadow rays.
static inline void rp_depart(__constant rp_render_params* params, uint slot, uint state, float3 radiance, uint pixel, uint sample, uint depth,
                             const rp_departure_1* out, __global uint* status, __global uint4* paths, __global uint* film, uint* mine) {
    const uint slot_count = params->slot_count;
    if (!out->shadow && !out->go_on) {
        rp_finish(params, status, slot, film, pixel, radiance);
        return;
    }
    const uint3 start = as_uint3(rp_float3(out->start));
    const uint3 direction = out->go_on ? as_uint3(rp_float3(out->direction)) : (uint3)(0u);
    const uint density = out->go_on ? as_uint(out->density) : 0u, specular = out->go_on && out->density == 0.0f ? RP_PATH_SPECULAR : 0u;
    RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot_count, slot) =
        (uint4)(as_uint3(rp_float3(out->throughput)), (depth + 1u) | specular | (out->go_on ? (uint)out->refraction << RP_PATH_REFRACTION_SHIFT : 0u));
    RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot) = (uint4)(as_uint3(radiance), pixel);
    if (out->shadow) {
        const uint3 light = as_uint3(rp_float3(out->light));
        RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot) = (uint4)(start, as_uint(out->light_reach));
        RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot) = (uint4)(as_uint3(rp_float3(out->light_direction)), density);
        RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)(direction, light.x);
        RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(light.yz, sample, RP_NONE);
        status[slot] = RP_STATUS_SHADOW | (out->go_on ? 0u : RP_STATUS_ENDS) | (state & RP_SHADE_KEEPS) | RP_SHADE_FIRST(depth);
    } else {
        RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot) = (uint4)(start, as_uint(INFINITY));
        RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot) = (uint4)(direction, density);
        RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)((uint3)(0u), RP_NONE);
        RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(0u, 0u, sample, RP_NONE);
        status[slot] = RP_STATUS_EXTEND | (state & RP_SHADE_KEEPS) | RP_SHADE_FIRST(depth);
    }
    mine[0] += out->go_on ? 1u : 0u;
    mine[1] += out->shadow ? 1u : 0u;
}

static inline void rp_shade_one(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                const rp_arrival* arrival, __global uint* status, __global uint4* paths, __global uint* film, uint* mine) {
    const rp_vertex_1* vertex = &arrival->vertex;
    rp_departure_1 out;
    if (arrival->material->kind == RP_MATERIAL_DIFFUSE) rp_scatter_diffuse_1(params, lights, light_steps, vertex, &out);
    else rp_scatter_special(params, lights, light_steps, arrival->material, vertex, &out);
    rp_depart(params, arrival->slot, arrival->state, arrival->radiance, vertex->pixel, vertex->sample, vertex->depth, &out, status, paths, film, mine);
}

#if RP_SHADE_LANES == 16
#define RP_FETCHED_AHEAD 12u  // entries of the queue: some hundred nanoseconds

// Vertices on diffuse surfaces that wait for their number to come to sixteen.
typedef struct rp_gathered {
    uint count;
    uint slot[16], state[16], normal[2][16], path[4][16];  // geometric, shading; pixel, sample, depth, refraction
    float radiance[3][16], vertex[13][16];      // direction, throughput, position, reflectance, offset
} rp_gathered;

static inline void rp_gather(rp_gathered* g, const rp_arrival* arrival) {
    const rp_vertex_1* v = &arrival->vertex;
    const uint k = g->count++;
    g->slot[k] = arrival->slot;
    g->state[k] = arrival->state;
    g->normal[0][k] = v->geometric_normal;
    g->normal[1][k] = v->shading_normal;
    g->path[0][k] = v->pixel;
    g->path[1][k] = v->sample;
    g->path[2][k] = v->depth;
    g->path[3][k] = (uint)v->refraction;
    g->radiance[0][k] = arrival->radiance.x;
    g->radiance[1][k] = arrival->radiance.y;
    g->radiance[2][k] = arrival->radiance.z;
    const rp_vector_1 of[4] = {v->direction, v->throughput, v->position, v->reflectance};
    for (uint i = 0u; i < 4u; i++) {
        g->vertex[3u * i][k] = of[i].x;
        g->vertex[3u * i + 1u][k] = of[i].y;
        g->vertex[3u * i + 2u][k] = of[i].z;
    }
    g->vertex[12][k] = v->offset;
}

static inline rp_vector_16 rp_load_vector(float (*rows)[16]) {
    const rp_vector_16 v = {vload16(0, rows[0]), vload16(0, rows[1]), vload16(0, rows[2])};
    return v;
}
static inline void rp_store_vector(rp_vector_16 v, float (*rows)[16]) {
    vstore16(v.x, 0, rows[0]);
    vstore16(v.y, 0, rows[1]);
    vstore16(v.z, 0, rows[2]);
}
static inline rp_vector_1 rp_of_lane(float (*rows)[16], uint k) {
    const rp_vector_1 v = {rows[0][k], rows[1][k], rows[2][k]};
    return v;
}

static inline void rp_shade_gathered(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps, rp_gathered* g,
                                     __global uint* status, __global uint4* paths, __global uint* film, uint* mine) {
    rp_vertex_16 vertex;
    vertex.direction = rp_load_vector(g->vertex);
    vertex.throughput = rp_load_vector(g->vertex + 3);
    vertex.position = rp_load_vector(g->vertex + 6);
    vertex.reflectance = rp_load_vector(g->vertex + 9);
    vertex.offset = vload16(0, g->vertex[12]);
    vertex.geometric_normal = vload16(0, g->normal[0]);
    vertex.shading_normal = vload16(0, g->normal[1]);
    vertex.pixel = vload16(0, g->path[0]);
    vertex.sample = vload16(0, g->path[1]);
    vertex.depth = vload16(0, g->path[2]);
    vertex.refraction = as_int16(vload16(0, g->path[3]));
    rp_departure_16 all;
    rp_scatter_diffuse_16(params, lights, light_steps, &vertex, &all);
    float rows[17][16];  // start, light direction, light, direction, throughput, reach, density
    int shadow[16], go_on[16];
    rp_store_vector(all.start, rows);
    rp_store_vector(all.light_direction, rows + 3);
    rp_store_vector(all.light, rows + 6);
    rp_store_vector(all.direction, rows + 9);
    rp_store_vector(all.throughput, rows + 12);
    vstore16(all.light_reach, 0, rows[15]);
    vstore16(all.density, 0, rows[16]);
    vstore16(all.shadow, 0, shadow);
    vstore16(all.go_on, 0, go_on);
    for (uint k = 0u; k < g->count; k++) {
        rp_departure_1 out;
        out.start = rp_of_lane(rows, k);
        out.light_direction = rp_of_lane(rows + 3, k);
        out.light = rp_of_lane(rows + 6, k);
        out.direction = rp_of_lane(rows + 9, k);
        out.throughput = rp_of_lane(rows + 12, k);
        out.light_reach = rows[15][k];
        out.density = rows[16][k];
        out.shadow = shadow[k];
        out.go_on = go_on[k];
        out.refraction = (int)g->path[3][k];
        const float3 radiance = (float3)(g->radiance[0][k], g->radiance[1][k], g->radiance[2][k]);
        rp_depart(params, g->slot[k], g->state[k], radiance, g->path[0][k], g->path[1][k], g->path[2][k], &out, status, paths, film, mine);
    }
    g->count = 0u;
}

// What one of `step` work-items does, whose number is `item`.
static RP_APART void rp_shade_runs(uint item, uint step, uint count, __constant rp_render_params* restrict params,
                                   const __global rp_material* restrict materials, const __global rp_light* restrict lights,
                                   const __global uint* restrict light_steps, const __global rp_primitive_range* restrict ranges,
                                   const __global uint* restrict queue, __global uint* restrict status, __global uint4* restrict paths,
                                   __global uint* restrict film, uint* mine) {
    rp_arrival arrival;
    rp_gathered gathered;
    gathered.count = 0u;
    // Runs of neighbouring slots, so that work-items do not write to the same cache lines.
    for (uint run = 64u * item; run < count; run += 64u * step) {
        for (uint i = run; i < min(run + 64u, count); i++) {
            const uint later = rp_extend_entry(queue, min(i + RP_FETCHED_AHEAD, count - 1u));
            rp_fetch_early(status + later);
            rp_fetch_path(paths, params->slot_count, later);
            const uint slot = rp_extend_entry(queue, i), state = status[slot];
            if ((state & RP_STATUS_MASK) != RP_STATUS_SHADE) continue;
            if (!rp_arrive(params, materials, lights, light_steps, ranges, slot, state, status, paths, film, &arrival)) continue;
            if (arrival.material->kind != RP_MATERIAL_DIFFUSE) {
                rp_shade_one(params, lights, light_steps, &arrival, status, paths, film, mine);
                continue;
            }
            rp_gather(&gathered, &arrival);
            if (gathered.count == 16u) rp_shade_gathered(params, lights, light_steps, &gathered, status, paths, film, mine);
        }
    }
    if (gathered.count != 0u) {
        // The lanes that are empty do what the first does, to no effect.
        for (uint k = gathered.count; k < 16u; k++) {
            for (uint i = 0u; i < 13u; i++) gathered.vertex[i][k] = gathered.vertex[i][0];
            for (uint i = 0u; i < 4u; i++) gathered.path[i][k] = gathered.path[i][0];
            for (uint i = 0u; i < 2u; i++) gathered.normal[i][k] = gathered.normal[i][0];
        }
        rp_shade_gathered(params, lights, light_steps, &gathered, status, paths, film, mine);
    }
}
#endif

__kernel void rp_shade(RP_SHADE_PARAMETERS __constant rp_render_params* restrict params, const __global rp_material* restrict materials,
                       const __global rp_light* restrict lights, const __global uint* restrict light_steps,
                       const __global rp_primitive_range* restrict ranges, const __global uint* restrict queue, __global uint* restrict status,
                       __global uint4* restrict paths, volatile __global uint* restrict counters, __global uint* restrict film) {
    const uint count = counters[RP_COUNT_EXTEND];
    __local uint totals[2];
    uint mine[2] = {0u, 0u};
    rp_begin_totals(totals, 2u);
#if RP_SHADE_LANES == 16
    rp_shade_runs((uint)get_global_id(0), (uint)get_global_size(0), count, params, materials, lights, light_steps, ranges, queue, status, paths, film, mine);
#else
    rp_arrival arrival;
#ifdef RP_SHORT_STATES
    const rp_geometry geometry = RP_MAKE_GEOMETRY(demand + RP_DEMAND_USED * block_count);
#endif
    for (uint i = get_global_id(0); i < count; i += get_global_size(0)) {
        const uint slot = rp_extend_entry(queue, i), state = status[slot];
        if ((state & RP_STATUS_MASK) == RP_STATUS_SHADE &&
            rp_arrive(RP_SHADE_FROM params, materials, lights, light_steps, ranges, slot, state, status, paths, film, &arrival))
            rp_shade_one(params, lights, light_steps, &arrival, status, paths, film, mine);
    }
#endif
    rp_add_totals(totals, mine, 2u, counters + RP_COUNT_BOUNCE_RAYS);
}
