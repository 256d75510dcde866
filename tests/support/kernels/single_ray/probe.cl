// For tests: traces given rays through resident blocks, outside the wavefront; and reports the layout of shared structs.
#include "shading/light.cl"
#include "common/path_state.cl"
#include "common/camera.cl"
#include "common/random.cl"
#include "common/sample_order.cl"
#include "shading/surface.cl"
#include "raypager/abi/film.h"
#include "raypager/abi/instance.h"
#include "raypager/abi/light_tree.h"
#include "raypager/abi/wide.h"

#define RP_ANY_HIT 0
#include "single_ray/traverse.cl"
#undef RP_ANY_HIT
#define RP_ANY_HIT 1
#include "single_ray/traverse.cl"
#undef RP_ANY_HIT

// rays: origin xyz, t max; direction xyz, unused. results: t (INFINITY: none), primitive, geometric normal, occluded within t max;
// position xyz, block entry the ray waits at. With RP_PROBE_UVS, which takes RP_UVS and RP_TANGENTS: u, v, density in place of the position, and
// the tangent in place of the normal.
__kernel void rp_probe(RP_GEOMETRY_PARAMETERS, uint block_count, const __global float4* restrict rays, uint count, __global uint4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    const float4 origin = rays[2u * i], direction = rays[2u * i + 1u];
    uint2 stack[RP_STACK_SIZE];
    uint any_stack[RP_STACK_SIZE];
    rp_closest_walk walk;
    walk.ray = rp_make_ray(origin.xyz, direction.xyz);
    walk.best.t = origin.w;
    walk.best.what = RP_NONE;
    walk.best.found_in = RP_NONE;
#ifdef RP_INSTANCES
    walk.best.instance = 0;
#if RP_INSTANCE_LEVELS > 1
    walk.best.chain = walk.ray.chain;
#else
    walk.best.number = 0u;
#endif
    rp_standing standing;
    standing.block_entry = RP_NONE;
    rp_begin_closest(&geometry, &walk, stack, RP_NONE, &standing);
#else
    rp_begin_closest(&geometry, &walk, stack, RP_NONE);
#endif
    rp_traverse_closest(&geometry, &walk, stack, 1u);
    rp_any_walk any;
    any.ray = rp_make_ray(origin.xyz, direction.xyz);
    any.search.t_limit = origin.w;
#ifdef RP_INSTANCES
    rp_begin_any(&geometry, &any, any_stack, RP_NONE, &standing);
#else
    rp_begin_any(&geometry, &any, any_stack, RP_NONE);
#endif
    rp_traverse_any(&geometry, &any, any_stack, 1u);
    uint3 position = (uint3)(0u);
    uint normal = 0u;
    if (walk.best.found_in != RP_NONE) {
#ifdef RP_INSTANCES
        const rp_surface s = rp_surface_in_world(&geometry, origin.xyz, direction.xyz, &walk.best);
#else
        const rp_surface s = rp_hit_surface(&geometry, &walk.ray, &walk.best);
#endif
        position = as_uint3(s.position);
        normal = s.geometric_normal;
#ifdef RP_PROBE_UVS
        position = as_uint3((float3)(s.uv, s.density));
        normal = s.tangent;
#endif
    }
    const uint primitive = rp_hit_primitive(&geometry, &walk.best);
    results[2u * i] = (uint4)(as_uint(primitive == RP_NONE ? INFINITY : walk.best.t), primitive, normal, any.hit ? 1u : 0u);
    results[2u * i + 1u] = (uint4)(position, rp_closest_block_entry(&walk));
}

__kernel void rp_struct_sizes(__global uint* sizes) {
    sizes[0] = sizeof(rp_node);
    sizes[1] = sizeof(rp_leaf);
    sizes[2] = sizeof(rp_block_header);
    sizes[3] = sizeof(rp_block_entry);
    sizes[4] = sizeof(rp_top_grid);
    sizes[5] = sizeof(rp_page);
    sizes[6] = sizeof(rp_material);
    sizes[7] = sizeof(rp_light);
    sizes[8] = sizeof(rp_primitive_range);
    sizes[9] = sizeof(rp_camera);
    sizes[10] = sizeof(rp_render_params);
    sizes[11] = sizeof(rp_path_sample);
    sizes[12] = sizeof(rp_wide_node);
    sizes[13] = sizeof(rp_wide_leaf);
    sizes[14] = sizeof(rp_wide_header);
    sizes[15] = sizeof(rp_wide_block_entry);
    sizes[16] = sizeof(rp_page_changes);
    sizes[17] = sizeof(rp_light_node);
    sizes[18] = sizeof(rp_instance);
    sizes[19] = sizeof(rp_object);
    sizes[20] = sizeof(rp_instance_traits);
}

// For tests of the box arithmetic: entry and exit of ray i against box i on a grid.
__kernel void rp_probe_boxes(const __global float4* restrict rays, const __global float4* restrict grids, const __global uint4* restrict boxes,
                             uint count, __global float2* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const rp_ray ray = rp_make_ray(rays[2u * i].xyz, rays[2u * i + 1u].xyz);
    const rp_grid_ray grid_ray = rp_make_grid_ray(&ray, grids[2u * i].xyz, grids[2u * i + 1u].xyz);
    results[i] = (float2)(rp_box_entry(boxes[i], &ray, &grid_ray), rp_box_exit(boxes[i], &ray, &grid_ray, rays[2u * i].w * RP_BOX_WIDEN));
}

// Whether the three numbers of each row are on both sides of 0.
__kernel void rp_probe_signs(const __global float* restrict numbers, uint count, __global uint* restrict results) {
    const uint i = get_global_id(0);
    if (i < count) results[i] = rp_signs_differ_1(numbers[3u * i], numbers[3u * i + 1u], numbers[3u * i + 2u]) ? 1u : 0u;
}

// For tests of random numbers. purposes: pixel, depth, purpose, seed. results: the numbers of samples 0 to `samples` - 1 for each of these.
__kernel void rp_probe_random(const __global uint4* restrict purposes, uint samples, uint count, __global uint4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count * samples) return;
    const uint4 p = purposes[i / samples];
    const rp_numbers_1 n = rp_random_bits_1(p.x, i % samples, p.y, p.z, p.w);
    results[i] = (uint4)(n.x, n.y, n.z, n.w);
}

// For tests of cameras. places: u, v and two numbers for the lens. results: origin and direction of the ray.
__kernel void rp_probe_camera(__constant rp_render_params* restrict params, const __global uint4* restrict places, uint count,
                              __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const uint4 place = places[i];
    const rp_camera_ray ray = rp_ray_of_camera(&params->camera, as_float(place.x), as_float(place.y), place.z, place.w);
    results[2u * i] = (float4)(ray.origin, 0.0f);
    results[2u * i + 1u] = (float4)(ray.direction, 0.0f);
}

#ifdef RP_PIXEL_FILTER
// For tests of pixel filters. numbers: two for each place. results: where the sample lies, from the middle of its pixel.
__kernel void rp_probe_filter(__constant rp_render_params* restrict params, const __global uint2* restrict numbers, uint count,
                              __global float2* restrict results) {
    const uint i = get_global_id(0);
    if (i < count) results[i] = rp_filtered_place(&params->filter, numbers[i].x, numbers[i].y);
}
#endif

// For tests of the order of samples (its words): those with the numbers first to first + count - 1.
__kernel void rp_probe_order(uint4 words, uint width, uint height, ulong first, uint count, __global rp_path_sample* restrict results) {
    const uint i = get_global_id(0);
    const rp_sample_order order = {words.x, words.y, words.z, words.w};
    // That of another sample, with luck of the same region.
    rp_sample_region region = rp_region_of(order, width * height, first + i / 2u);
    if (i < count) results[i] = rp_numbered_sample(order, width, height, first + i, &region);
}

// For tests of the choice of a light. results: which light number i chooses, and the rest of the number.
__kernel void rp_probe_light_choice(const __global uint* restrict steps, uint lights, const __global uint* restrict numbers,
                                    const __global float* restrict fine, uint count, __global uint2* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    float rest;
    const uint light = rp_choose_light(steps, lights, numbers[i], fine[i], &rest);
    results[i] = (uint2)(light, as_uint(rest));
}

#ifdef RP_LIGHT_TREE
// For tests of the choice by a tree. results: which light numbers i choose at place i, and the rest; its probability, and the same found by its way
// (0 for a light without a place).
__kernel void rp_probe_light_tree(const __global uint* restrict tree, const __global rp_light* restrict lights,
                                  const __global float4* restrict places, const __global uint2* restrict numbers, uint count,
                                  __global uint4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    float rest, chance, weighed;
    const uint light = rp_choose_light_at(tree, lights, places[i].xyz, (float3)(0.0f), numbers[i].x, numbers[i].y, &rest, &chance, &weighed);
    const bool placed = lights[light].kind != RP_LIGHT_INFINITE && lights[light].kind != RP_LIGHT_DISTANT;
    results[i] = (uint4)(light, as_uint(rest), as_uint(chance), as_uint(placed ? rp_light_chance(tree, places[i].xyz, light) : 0.0f));
}
// With a normal. results: which light, its probability, that without the normal, and the same found by its way.
__kernel void rp_probe_light_facing(const __global uint* restrict tree, const __global rp_light* restrict lights,
                                    const __global float4* restrict places, const __global float4* restrict normals,
                                    const __global uint2* restrict numbers, uint count, __global uint4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    float rest, chance, weighed;
    const uint light = rp_choose_light_at(tree, lights, places[i].xyz, normals[i].xyz, numbers[i].x, numbers[i].y, &rest, &chance, &weighed);
    const bool placed = lights[light].kind != RP_LIGHT_INFINITE && lights[light].kind != RP_LIGHT_DISTANT;
    results[i] =
        (uint4)(light, as_uint(chance), as_uint(weighed), as_uint(placed ? rp_light_chance(tree, places[i].xyz, light) : lights[light].probability));
}
// Of all lights, place by place; 0 for those without one.
__kernel void rp_probe_light_chances(const __global uint* restrict tree, const __global rp_light* restrict lights, uint light_count,
                                     const __global float4* restrict places, uint count, __global float* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const uint light = i % light_count;
    const bool placed = lights[light].kind != RP_LIGHT_INFINITE && lights[light].kind != RP_LIGHT_DISTANT;
    results[i] = placed ? rp_light_chance(tree, places[i / light_count].xyz, light) : 0.0f;
}
#endif

#ifdef RP_SKY
// For tests of skies: directions that numbers (x, y, z of a light sample) draw. results: direction, density of the sample; its radiance, the density
// that is found for its direction; the radiance that is found for it, 0.
__kernel void rp_probe_sky(const __global uint* restrict sky, const __global uint4* restrict numbers, uint count, __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    float density;
    const float2 place = rp_sample_sky(sky, numbers[i].y, rp_unit_1(numbers[i].x), rp_unit_1(numbers[i].z), &density);
    const float3 direction = rp_sky_direction(place);
    const float2 found = rp_sky_place(direction);
    results[3u * i] = (float4)(direction, density);
    results[3u * i + 1u] = (float4)(rp_sky_radiance(sky, place), rp_sky_density(sky, found));
    results[3u * i + 2u] = (float4)(rp_sky_radiance(sky, found), 0.0f);
}
// Of given directions: density, then radiance.
__kernel void rp_probe_sky_directions(const __global uint* restrict sky, const __global float4* restrict directions, uint count,
                                      __global float4* restrict results) {
    const uint i = get_global_id(0);
    if (i >= count) return;
    const float2 place = rp_sky_place(directions[i].xyz);
    results[i] = (float4)(rp_sky_density(sky, place), rp_sky_radiance(sky, place));
}
#endif

#ifdef RP_PERSISTENT
// Takes rays as single_ray/extend.cl does, and counts for each place in a queue of `count` how often it was taken.
__kernel void rp_probe_parts(uint count, volatile __global uint* restrict taken, volatile __global uint* restrict times) {
    const uint parts = rp_part_count();
    uint part = rp_own_part(parts);
    while (part != RP_NONE) {
        const uint i = rp_part_position(rp_take_numbers(true, taken + part), part, parts);
        if (rp_ballot(i >= count) != 0u) part = rp_next_part(taken, part, parts, count);
        if (i < count) atomic_inc(times + i);
    }
}
#endif
