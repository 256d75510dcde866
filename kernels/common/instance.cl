// Rays on their way into an instance.
#ifndef RP_INSTANCE_CL
#define RP_INSTANCE_CL

#include "common/box.cl"
#include "raypager/abi/path.h"
#include "raypager/abi/instance.h"

// Where a ray that waits stands, as far as instances are concerned.
typedef struct rp_standing {
    // Of the innermost object, at which it waits; RP_NONE: it waits in the world; RP_STANDS_BEHIND: for the block of the innermost instance, to go on
    // behind that.
    uint block_entry;
#if defined(RP_INSTANCES) && RP_INSTANCE_LEVELS > 1
    uint depth;                             // instances in which it is
    rp_instance_chain chain;                // copies
    uint entry_around[RP_INSTANCE_LEVELS];  // where each of them lies: block entry in the space around it
#else
    uint number;                           // of the instance, as rp_ray has it
    const __global rp_instance* instance;  // a copy
#endif
} rp_standing;

// A ray in the space of an object. Its direction is as long as the transform makes it, so that distances along it are those in the world, from
// `start` on.
typedef struct rp_placed_ray {
    float3 origin, direction;
    float start;  // how far along the ray in the world it begins
} rp_placed_ray;

static inline float rp_dot_fused(float3 a, float3 b) { return fma(a.x, b.x, fma(a.y, b.y, rp_mul(a.z, b.z))); }

// First the ray is moved along itself to where it comes near: transformed from where it begins, it would miss by what its coordinates there are
// rounded to, which at a distance of 10^6 times the object's size is a seventh of that. base: of the object (abi/instance.h). In fixed operations,
// since more than one stage does this.
static inline rp_placed_ray rp_place_ray_from(float start, const __global rp_instance* instance, float3 base, float3 origin, float3 direction) {
    rp_placed_ray placed;
    placed.start = start;
    const float3 near = (float3)(fma(start, direction.x, origin.x), fma(start, direction.y, origin.y), fma(start, direction.z, origin.z)) -
                        rp_load3(instance->center);
    const float3 x = rp_load3(instance->to_object), y = rp_load3(instance->to_object + 3), z = rp_load3(instance->to_object + 6);
    placed.origin = base + (float3)(rp_dot_fused(x, near), rp_dot_fused(y, near), rp_dot_fused(z, near));
    placed.direction = (float3)(rp_dot_fused(x, direction), rp_dot_fused(y, direction), rp_dot_fused(z, direction));
    return placed;
}
// REQUIRES: a direction of length 1, as rays in the world have.
static inline rp_placed_ray rp_place_ray(const __global rp_instance* instance, float3 base, float3 origin, float3 direction) {
    const float3 to_center = rp_load3(instance->center) - origin;
    return rp_place_ray_from(rp_max(rp_dot_fused(to_center, direction) - instance->reach, 0.0f), instance, base, origin, direction);
}

#if defined(RP_INSTANCES) && RP_INSTANCE_LEVELS > 1
// The same of a ray whose direction is of any length, as it is inside another instance.
static inline rp_placed_ray rp_place_ray_inside(const __global rp_instance* instance, float3 base, float3 origin, float3 direction) {
    const float3 to_center = rp_load3(instance->center) - origin;
    const float squared = rp_dot_fused(direction, direction);
    const float start = rp_max((rp_dot_fused(to_center, direction) - rp_mul(instance->reach, sqrt(squared))) / squared, 0.0f);
    return rp_place_ray_from(start <= FLT_MAX ? start : 0.0f, instance, base, origin, direction);
}
static inline float3 rp_base_of(const __global rp_object* objects, const __global rp_instance* instance) {
    return rp_load3(objects[instance->object].base);
}
// The ray in the world that goes into the first `depth` instances of a chain, at least one, through each in turn: so each transform has small
// numbers. With the product of all of them, what is small and far from the world's origin would be lost in rounding.
static inline rp_placed_ray rp_place_ray_in_chain(const __global rp_object* objects, const rp_instance_chain* chain, uint depth, float3 origin,
                                                  float3 direction) {
    rp_placed_ray placed = rp_place_ray(chain->instance[0], rp_base_of(objects, chain->instance[0]), origin, direction);
    for (uint i = 1u; i < depth; i++) {
        const __global rp_instance* const instance = chain->instance[i];
        const rp_placed_ray next = rp_place_ray_inside(instance, rp_base_of(objects, instance), placed.origin, placed.direction);
        placed.origin = next.origin;
        placed.direction = next.direction;
        placed.start = rp_add(placed.start, next.start);
    }
    return placed;
}
// How deep it is.
static inline uint rp_instance_depth(const rp_instance_chain* chain) {
    uint depth = 0u;
    while (depth < RP_INSTANCE_LEVELS && chain->number[depth] != 0u) depth++;
    return depth;
}
#elif defined(RP_INSTANCES)
// The ray in the world that goes into an instance. base: of its object. number: as rp_ray has it.
static inline rp_ray rp_ray_inside(const __global rp_instance* instance, uint number, float3 base, float3 origin, float3 direction) {
    const rp_placed_ray placed = rp_place_ray(instance, base, origin, direction);
    rp_ray ray = rp_make_ray(placed.origin, placed.direction);
    ray.instance = instance;
    ray.number = number;
    ray.start = placed.start;
    return ray;
}
#endif

#ifdef RP_INSTANCES
static inline ulong rp_instance_path(const __global rp_instance* instance) {
    return (ulong)(instance->path_high & RP_INSTANCE_PATH_HIGH) << 32 | instance->path_low;
}
// The number of the traits of an instance, which may be null; 0: none.
static inline uint rp_instance_traits_number(const __global rp_instance* instance) {
    return instance ? instance->path_high >> RP_INSTANCE_TRAITS_SHIFT : 0u;
}
#endif

#endif
