// The rays of cameras (abi/scene.h, raypager/scene.hpp): of a pinhole camera, unless the kernel is built with RP_PROJECTION, RP_LENS or
// RP_PIXEL_FILTER.
#ifndef RP_CAMERA_CL
#define RP_CAMERA_CL

#include "common/arithmetic.cl"
#include "common/random.cl"
#include "raypager/abi/scene.h"

#define RP_LANES 1
#include "common/begin_lanes.cl"
#include "common/turns_lanes.cl"
#include "common/end_lanes.cl"
#undef RP_LANES

#ifndef RP_PROJECTION
#define RP_PROJECTION 0
#endif

typedef struct rp_camera_ray {
    float3 origin, direction;  // the latter unit
} rp_camera_ray;

#ifdef RP_PIXEL_FILTER
// How far from the middle of the pixel one of its samples lies along an axis, by a uniform number: the lower half of all numbers is for one side.
static inline float rp_filtered_distance(__constant rp_pixel_filter* filter, uint axis, uint bits) {
    const float side = 2.0f * rp_unit_1(bits) - 1.0f, share = fabs(side);
    __constant float* shares = filter->share[axis];
    uint low = 0u, high = RP_FILTER_STEPS;
    while (high - low > 1u) {
        const uint middle = (low + high) >> 1u;
        if (shares[middle] <= share)
            low = middle;
        else
            high = middle;
    }
    const float step = shares[high] - shares[low], rest = step > 0.0f ? fmin((share - shares[low]) / step, 1.0f) : 0.0f;
    const float distance = filter->radius[axis] * (((float)low + rest) * (1.0f / (float)RP_FILTER_STEPS));
    return side < 0.0f ? -distance : distance;
}
static inline float2 rp_filtered_place(__constant rp_pixel_filter* filter, uint x, uint y) {
    return (float2)(rp_filtered_distance(filter, 0u, x), rp_filtered_distance(filter, 1u, y));
}
#endif

#if RP_PROJECTION == 2
// (u, v) -> (right, up, forward). Latitude and longitude.
static inline float3 rp_direction_all_around(float u, float v) {
    float sine, cosine, across, along;
    rp_sincos_turns_1(0.5f * v, &sine, &cosine);
    rp_sincos_turns_1(u, &along, &across);
    return (float3)(sine * across, cosine, sine * along);
}
#elif RP_PROJECTION == 3
// The same by Clarberg's map (2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"). The axis of its middle and corners is up. What a
// filter finds beyond an edge lies within the square again, as if folded over there.
static inline float3 rp_direction_all_around(float u, float v) {
    if (u < 0.0f || u > 1.0f) {
        u = u < 0.0f ? -u : 2.0f - u;
        v = 1.0f - v;
    }
    if (v < 0.0f || v > 1.0f) {
        v = v < 0.0f ? -v : 2.0f - v;
        u = 1.0f - u;
    }
    const float x = 2.0f * u - 1.0f, y = 2.0f * v - 1.0f, ax = fabs(x), ay = fabs(y);
    const float inside = 1.0f - (ax + ay), r = 1.0f - fabs(inside);
    const float eighths = r == 0.0f ? 1.0f : (ay - ax) / r + 1.0f;
    const float height = 1.0f - r * r, beside = r * sqrt(2.0f - r * r);
    float sine, cosine;
    rp_sincos_turns_1(0.125f * eighths, &sine, &cosine);
    return (float3)(copysign(cosine * beside, x), copysign(height, inside), copysign(sine * beside, y));
}
#endif

// lens_x, lens_y: uniform numbers for the place on the lens.
static inline rp_camera_ray rp_ray_of_camera(__constant rp_camera* camera, float u, float v, uint lens_x, uint lens_y) {
#pragma OPENCL FP_CONTRACT ON
    const float3 eye = (float3)(camera->eye[0], camera->eye[1], camera->eye[2]);
    const float3 right = (float3)(camera->right[0], camera->right[1], camera->right[2]);
    const float3 up = (float3)(camera->up[0], camera->up[1], camera->up[2]);
    const float3 forward = (float3)(camera->forward[0], camera->forward[1], camera->forward[2]);
    rp_camera_ray ray;
#if RP_PROJECTION >= 2
    const float3 d = rp_direction_all_around(camera->window[0] + u * camera->window[2], camera->window[1] + v * camera->window[3]);
    ray.origin = eye;
    ray.direction = normalize(d.z * forward + d.x * right + d.y * up);
#else
#if RP_PROJECTION == 1
    ray.origin = eye + (2.0f * u - 1.0f) * right + (1.0f - 2.0f * v) * up;
#else
    ray.origin = eye;
#endif
#ifdef RP_LENS
#if RP_PROJECTION == 1
    const float3 ahead = forward;
#else
    const float3 ahead = forward + (2.0f * u - 1.0f) * right + (1.0f - 2.0f * v) * up;
#endif
    // Uniform on the unit disk.
    float sine, cosine;
    const float radius = sqrt(rp_unit_1(lens_x));
    rp_sincos_turns_1(rp_unit_1(lens_y), &sine, &cosine);
    const float3 on_lens = radius * cosine * (float3)(camera->lens_right[0], camera->lens_right[1], camera->lens_right[2]) +
                           radius * sine * (float3)(camera->lens_up[0], camera->lens_up[1], camera->lens_up[2]);
    ray.origin += on_lens;
    ray.direction = normalize(camera->focal_distance * ahead - on_lens);
#elif RP_PROJECTION == 1
    ray.direction = normalize(forward);
#else
    ray.direction = normalize(forward + (2.0f * u - 1.0f) * right + (1.0f - 2.0f * v) * up);
#endif
#endif
    return ray;
}

#endif
