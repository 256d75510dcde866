// Rays against quantised boxes. Conservative: a ray that meets a primitive, by the test of primitive.cl, meets every box around it, and
// enters that box no later than the distance that the primitive's test returns.
//
// Why: a plane lies at t = fma(grid, cell * inv, (grid origin - ray origin) * inv). In float arithmetic (u = 2^-24), t is wrong by a few
// u * (|D| + |w|) * |inv|, with D = grid origin - ray origin and w = grid * cell. Boxes are rounded outwards by RP_GRID_SLACK = 1/16 of a
// cell, 1.9e-6 of the block's extent, which covers that while the ray starts within two extents of the block (along that axis). For
// origins farther away it is within 16 u of t itself, and RP_BOX_WIDEN covers it. What a primitive's test accepts beside its bounds, some 2^-23 of
// its length at most, is covered on all axes, since none of a grid is shorter than an eighth of another. tests/property tries to refute this.
#ifndef RP_BOX_CL
#define RP_BOX_CL

#include "common/arithmetic.cl"
#include "raypager/abi/block.h"
#include "raypager/abi/instance.h"

#define RP_BOX_WIDEN 1.000002f  // above 1 + 32 u
// So many floats farther along, which is between 1.000002 and 1.0000041 times as far.
#define RP_BOX_WIDEN_STEPS 34

#ifdef RP_INSTANCES
// Instances may lie in objects that are placed by instances, so many levels deep.
#ifndef RP_INSTANCE_LEVELS
#define RP_INSTANCE_LEVELS 1
#endif
// The instances in which something is, from the outermost one on; and their numbers + 1, where 0: there is none, and none behind it.
typedef struct rp_instance_chain {
    const __global rp_instance* instance[RP_INSTANCE_LEVELS];
    uint number[RP_INSTANCE_LEVELS];
} rp_instance_chain;
#endif

// What stays the same along a ray.
typedef struct rp_ray {
    float3 origin, direction, reciprocal;
    uint near_x, near_y, near_z;  // selectors: is the lower or the upper plane of an axis the near one
#ifdef RP_INSTANCES
    const __global rp_instance* instance;  // in whose space it is; 0: in the world
    float start;                           // how far along the ray in the world this one begins
#if RP_INSTANCE_LEVELS > 1
    rp_instance_chain chain;  // ends with `instance`
#else
    uint number;  // its number + 1, or 0
#endif
#endif
} rp_ray;

// A ray seen from a grid: t of a plane = fma(grid coordinate, scale, shift).
typedef struct rp_grid_ray {
    float3 scale, shift;
} rp_grid_ray;

static inline rp_ray rp_make_ray(float3 origin, float3 direction) {
    rp_ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.reciprocal = (float3)(rp_safe_reciprocal(direction.x), rp_safe_reciprocal(direction.y), rp_safe_reciprocal(direction.z));
    ray.near_x = ray.reciprocal.x < 0.0f ? RP_NEAR_IS_UPPER : RP_NEAR_IS_LOWER;
    ray.near_y = ray.reciprocal.y < 0.0f ? RP_NEAR_IS_UPPER : RP_NEAR_IS_LOWER;
    ray.near_z = ray.reciprocal.z < 0.0f ? RP_NEAR_IS_UPPER : RP_NEAR_IS_LOWER;
#ifdef RP_INSTANCES
    ray.instance = 0;
    ray.start = 0.0f;
#if RP_INSTANCE_LEVELS > 1
    for (uint i = 0u; i < RP_INSTANCE_LEVELS; i++) ray.chain.instance[i] = 0, ray.chain.number[i] = 0u;
#else
    ray.number = 0u;
#endif
#endif
    return ray;
}

static inline rp_grid_ray rp_make_grid_ray(const rp_ray* ray, float3 grid_origin, float3 cell) {
    rp_grid_ray grid_ray;
    grid_ray.scale = cell * ray->reciprocal;
    grid_ray.shift = (grid_origin - ray->origin) * ray->reciprocal;
    return grid_ray;
}

// Distances are compared as integers: floats that are not negative have the same order as their bits, and a negative one is a negative
// integer. GPUs take the least of three integers in one instruction, together with a bound or a sum (on an NVIDIA H100 the walk is bound by
// such instructions: bench/journal/gpu-traversal.md). Entries come out the same as with floats; exits are widened by RP_BOX_WIDEN_STEPS.
// -0, which would be behind all others, is none of these: grids are too coarse for products to vanish (src/block/grid.cpp).

// Where the ray enters the box, at least 0.
static inline float rp_box_entry(uint4 box, const rp_ray* ray, const rp_grid_ray* grid_ray) {
    const int x = as_int(fma(rp_grid_near(box.x, ray->near_x), grid_ray->scale.x, grid_ray->shift.x));
    const int y = as_int(fma(rp_grid_near(box.y, ray->near_y), grid_ray->scale.y, grid_ray->shift.y));
    const int z = as_int(fma(rp_grid_near(box.z, ray->near_z), grid_ray->scale.z, grid_ray->shift.z));
    return as_float(max(max(max(x, y), z), 0));
}

// Where it leaves the box, widened, at most `far`, which is t_max times RP_BOX_WIDEN.
static inline float rp_box_exit(uint4 box, const rp_ray* ray, const rp_grid_ray* grid_ray, float far) {
    const int x = as_int(fma(rp_grid_far(box.x, ray->near_x), grid_ray->scale.x, grid_ray->shift.x));
    const int y = as_int(fma(rp_grid_far(box.y, ray->near_y), grid_ray->scale.y, grid_ray->shift.y));
    const int z = as_int(fma(rp_grid_far(box.z, ray->near_z), grid_ray->scale.z, grid_ray->shift.z));
    return as_float(min(min(min(x, y), z) + RP_BOX_WIDEN_STEPS, as_int(far)));
}

// Whether the ray meets the box.
static inline bool rp_box_is_met(float entry, float leave) { return as_int(entry) <= as_int(leave); }

#endif
