// Rays on their way into an instance.
#ifndef RP_INSTANCE_CL
#define RP_INSTANCE_CL

#include "common/box.cl"
#include "raypager/abi/path.h"
#include "raypager/abi/instance.h"

// Where a ray that waits stands, as far as instances are concerned.
typedef struct rp_standing {
    // Of the object, at which it waits; RP_NONE: it waits in the world; RP_STANDS_BEHIND: for the block of an instance, to go on behind that.
    uint block_entry;
    uint number;                           // of the instance, as rp_ray has it
    const __global rp_instance* instance;  // a copy
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
static inline rp_placed_ray rp_place_ray(const __global rp_instance* instance, float3 base, float3 origin, float3 direction) {
    const float3 center = rp_load3(instance->center), to_center = center - origin;
    rp_placed_ray placed;
    placed.start = rp_max(rp_dot_fused(to_center, direction) - instance->reach, 0.0f);
    const float3 near =
        (float3)(fma(placed.start, direction.x, origin.x), fma(placed.start, direction.y, origin.y), fma(placed.start, direction.z, origin.z)) -
        center;
    const float3 x = rp_load3(instance->to_object), y = rp_load3(instance->to_object + 3), z = rp_load3(instance->to_object + 6);
    placed.origin = base + (float3)(rp_dot_fused(x, near), rp_dot_fused(y, near), rp_dot_fused(z, near));
    placed.direction = (float3)(rp_dot_fused(x, direction), rp_dot_fused(y, direction), rp_dot_fused(z, direction));
    return placed;
}

#ifdef RP_INSTANCES
// The ray in the world that goes into an instance. base: of its object. number: as rp_ray has it.
static inline rp_ray rp_ray_inside(const __global rp_instance* instance, uint number, float3 base, float3 origin, float3 direction) {
    const rp_placed_ray placed = rp_place_ray(instance, base, origin, direction);
    rp_ray ray = rp_make_ray(placed.origin, placed.direction);
    ray.inside = instance;
    ray.number = number;
    ray.start = placed.start;
    return ray;
}

// Of a ray that has stopped at a block entry. world_entry: where it is in the world.
static inline uint rp_stands_at(const rp_ray* ray, uint world_entry, uint block_entry) {
    return !ray->inside ? RP_NONE : block_entry == world_entry ? RP_STANDS_BEHIND : block_entry;
}
static inline ulong rp_instance_path(const __global rp_instance* instance) {
    return (ulong)(instance->path_high & RP_INSTANCE_PATH_HIGH) << 32 | instance->path_low;
}
// The number of the traits of an instance, which may be null; 0: none.
static inline uint rp_instance_traits_number(const __global rp_instance* instance) {
    return instance ? instance->path_high >> RP_INSTANCE_TRAITS_SHIFT : 0u;
}
#endif

#endif
