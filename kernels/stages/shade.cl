// Fourth stage: at the end of an extension ray. Adds what the surface or the background emits, connects to a light (the shadow ray is
// traced by the stage `connect`), and scatters. The light transport is that of pbrt's path integrator (Pharr, Jakob, Humphreys 2023,
// chapter 13.4): next-event estimation and BSDF sampling combined by multiple importance sampling.
#include "lib/film.cl"
#include "lib/light.cl"
#include "lib/path.cl"
#include "lib/random.cl"
#include "lib/surface.cl"

#define RP_ROULETTE_DEPTH 3u  // Russian roulette on throughput begins after so many scattering events

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
    const float weight = full ? 1.0f : rp_mis_weight(bsdf_density, light->probability * (0.25f * RP_INV_PI));
    return rp_light_radiance(light) * weight;
}

static inline float3 rp_emission(const __global rp_light* light, float3 normal, float3 direction, float distance, float bsdf_density, bool full) {
    const float light_density = rp_light_density(light, normal, direction, distance);
    if (light_density == 0.0f) return (float3)(0.0f);
    return rp_light_radiance(light) * (full ? 1.0f : rp_mis_weight(bsdf_density, light_density));
}

// The shading frame at a hit. surface: geometric normal; shading normal, or the word of a point.
static inline rp_shading rp_shading_at(const __global rp_primitive_range* range, const __global rp_material* material, uint2 surface, float3 direction) {
    const float3 normal = rp_decode_normal(surface.x);
    if (range->flags & RP_RANGE_POINT_COLOR) {
        const float3 root = (float3)(surface.y >> 8 & 255u, surface.y >> 16 & 255u, surface.y >> 24) / 255.0f;
        return rp_make_shading(normal, normal, direction, root * root);
    }
    return rp_make_shading(normal, rp_decode_normal(surface.y), direction, (float3)(material->color[0], material->color[1], material->color[2]));
}

static inline void rp_finish(__global uint* status, uint slot, __global uint* film, uint pixel, float3 radiance) {
    rp_film_add(film, pixel, radiance);
    status[slot] = RP_STATUS_FREE;
}

// mine: counts of bounce rays and shadow rays.
static inline void rp_shade_hit(__constant rp_render_params* params, const __global rp_material* materials, const __global rp_light* lights,
                                const __global uint* light_steps, const __global rp_primitive_range* ranges, uint slot, uint state,
                                __global uint* status, __global uint4* paths, __global uint* film, uint* mine) {
    const uint slot_count = params->slot_count;
    const uint4 direction_plane = RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot);
    const uint4 throughput_plane = RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot_count, slot);
    const uint4 radiance_plane = RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot);
    const uint4 hit = RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot), surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot);
    const float3 direction = as_float3(direction_plane.xyz);
    const float bsdf_density = as_float(direction_plane.w);
    float3 throughput = as_float3(throughput_plane.xyz), radiance = as_float3(radiance_plane.xyz);
    const uint pixel = radiance_plane.w, sample = surface.z, flags = throughput_plane.w, depth = flags & RP_PATH_DEPTH_MASK;
    const bool full_emission = (flags & RP_PATH_SPECULAR) != 0u;

    if (hit.w == RP_NONE) {
        radiance += throughput * rp_background(params, lights, bsdf_density, full_emission);
        rp_finish(status, slot, film, pixel, radiance);
        return;
    }
    const uint range = rp_find_range(ranges, params->range_count, hit.w);
    const __global rp_material* material = materials + ranges[range].material;
    const float3 position = as_float3(hit.xyz), geometric_normal = rp_decode_normal(surface.x);
    if (ranges[range].first_light != RP_NONE) {
        const __global rp_light* light = lights + ranges[range].first_light + (hit.w - ranges[range].first_primitive);
        const float distance = as_float(RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot).w);
        radiance += throughput * rp_emission(light, geometric_normal, direction, distance, bsdf_density, full_emission);
    }
    if (depth >= params->max_depth) {
        rp_finish(status, slot, film, pixel, radiance);
        return;
    }

    const rp_shading shading = rp_shading_at(ranges + range, material, surface.xy, direction);
    const float offset = rp_offset_distance(state >> RP_STATUS_OFFSET_SHIFT);
    const uint4 light_bits = rp_random_bits(pixel, sample, depth + 1u, RP_RANDOM_LIGHT, params->seed);
    const float4 light_random = rp_unit(light_bits);
    const float4 bsdf_random = rp_random(pixel, sample, depth + 1u, RP_RANDOM_BSDF, params->seed);

    // Connection. With the paper's roulette (3.3), half of the paths connect and end, the others go on without; each counts double.
    bool connect = params->light_count != 0u && !rp_is_specular(material), go_on = true;
    if (params->roulette_connection && connect) {
        connect = bsdf_random.w < 0.5f;
        go_on = !connect;
        throughput *= 2.0f;
    }
    float3 light_contribution = (float3)(0.0f), light_direction = (float3)(0.0f);
    float light_distance = 0.0f;
    const float3 outside = position + offset * shading.geometric_normal;
    if (connect) {
        const uint index = rp_choose_light(light_steps, params->light_count, light_bits.x);
        const rp_light_sample light = rp_sample_light(lights + index, outside, light_random.yz);
        float density;
        const float3 reflected = rp_bsdf_evaluate(material, &shading, light.direction, &density);
        const float weight = light.density > 0.0f ? rp_mis_weight(light.density, density) : 1.0f;
        light_contribution = throughput * reflected * light.radiance * weight;
        light_direction = light.direction;
        light_distance = light.reach;
    }
    const bool shadow = any(isgreater(light_contribution, (float3)(0.0f)));

    // Scattering.
    rp_scatter scatter;
    if (go_on) {
        scatter = rp_bsdf_sample(material, &shading, bsdf_random);
        throughput *= scatter.weight;
        const float largest = fmax(fmax(throughput.x, throughput.y), throughput.z);
        go_on = largest > 0.0f;
        if (go_on && depth + 1u >= RP_ROULETTE_DEPTH) {
            const float survival = fmin(0.95f, largest);
            go_on = light_random.w < survival;
            throughput /= survival;
        }
    }
    if (!shadow && !go_on) {
        rp_finish(status, slot, film, pixel, radiance);
        return;
    }
    const float3 start = go_on && scatter.transmitted ? position - offset * shading.geometric_normal : outside;
    const uint specular = go_on && scatter.density == 0.0f ? RP_PATH_SPECULAR : 0u;
    RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot_count, slot) = (uint4)(as_uint3(throughput), (depth + 1u) | specular | (go_on ? 0u : RP_PATH_ENDS));
    RP_PLANE(paths, RP_PLANE_RADIANCE, slot_count, slot) = (uint4)(as_uint3(radiance), pixel);
    const float next_density = go_on ? scatter.density : 0.0f;
    const float3 next_direction = go_on ? scatter.direction : (float3)(0.0f);
    if (shadow) {
        // Both rays of a vertex start at the same point: only specular scattering leaves on the other side, and it has no shadow ray.
        const uint3 contribution = as_uint3(light_contribution);
        RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot) = (uint4)(as_uint3(outside), as_uint(light_distance));
        RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot) = (uint4)(as_uint3(light_direction), as_uint(next_density));
        RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)(as_uint3(next_direction), contribution.x);
        RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(contribution.yz, sample, RP_NONE);
        status[slot] = RP_STATUS_SHADOW;
    } else {
        RP_PLANE(paths, RP_PLANE_ORIGIN, slot_count, slot) = (uint4)(as_uint3(start), as_uint(INFINITY));
        RP_PLANE(paths, RP_PLANE_DIRECTION, slot_count, slot) = (uint4)(as_uint3(next_direction), as_uint(next_density));
        RP_PLANE(paths, RP_PLANE_HIT, slot_count, slot) = (uint4)((uint3)(0u), RP_NONE);
        RP_PLANE(paths, RP_PLANE_SURFACE, slot_count, slot) = (uint4)(0u, 0u, sample, RP_NONE);
        status[slot] = RP_STATUS_EXTEND;
    }
    mine[0] += go_on;
    mine[1] += shadow;
}

__kernel void rp_shade(__constant rp_render_params* restrict params, const __global rp_material* restrict materials, const __global rp_light* restrict lights,
                       const __global uint* restrict light_steps, const __global rp_primitive_range* restrict ranges, const __global uint* restrict queue,
                       __global uint* restrict status, __global uint4* restrict paths, volatile __global uint* restrict counters,
                       __global uint* restrict film) {
    const uint count = counters[RP_COUNT_EXTEND];
    __local uint totals[2];
    uint mine[2] = {0u, 0u};
    rp_begin_totals(totals, 2u);
    for (uint i = get_global_id(0); i < count; i += get_global_size(0)) {
        const uint slot = rp_extend_entry(queue, i), state = status[slot];
        if ((state & RP_STATUS_MASK) == RP_STATUS_SHADE)
            rp_shade_hit(params, materials, lights, light_steps, ranges, slot, state, status, paths, film, mine);
    }
    rp_add_totals(totals, mine, 2u, counters + RP_COUNT_BOUNCE_RAYS);
}
