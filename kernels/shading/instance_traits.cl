// What an instance has of its own where a path has arrived (abi/instance.h).
#ifndef RP_INSTANCE_TRAITS_CL
#define RP_INSTANCE_TRAITS_CL

#include "raypager/abi/instance.h"
#include "raypager/abi/scene.h"

// Of the instance that was hit; null: it has none. Traits lie behind the ranges of primitives.
static inline const __global rp_instance_traits* rp_traits_numbered(const __global rp_primitive_range* ranges, uint range_count, uint number) {
    return number == 0u ? 0 : (const __global rp_instance_traits*)(ranges + range_count) + (number - 1u);
}

static inline uint rp_traits_material(const __global rp_instance_traits* traits, uint material) {
    return traits && traits->material != RP_NONE ? traits->material : material;
}

// The light with this number of the hit primitive's range, among all of them.
static inline uint rp_traits_light(const __global rp_instance_traits* traits, uint number) {
    return traits && traits->first_light != RP_NONE ? traits->first_light + number : number;
}

static inline float3 rp_traits_color(const __global rp_instance_traits* traits) {
    return traits ? (float3)(traits->color[0], traits->color[1], traits->color[2]) : (float3)(1.0f);
}

#endif
