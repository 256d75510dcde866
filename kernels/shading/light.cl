// Next-event estimation: choose a light, sample a point on it; and the density with which that would have found a given emitter.
#ifndef RP_LIGHT_CL
#define RP_LIGHT_CL

#include "common/arithmetic.cl"
#include "common/random.cl"
#include "raypager/abi/scene.h"

#define RP_INV_PI 0.31830988618f

// The light that a uniform 32-bit random number chooses: steps[i] is the last one of light i. (A float could not tell many lights apart.)
// rest: where the number lies among those of the light, a random number in [0, 1) of its own, evenly spread over samples if `random` is.
// fine: in [0, 1), for the digits that a light with few numbers lacks.
static inline uint rp_choose_light(const __global uint* steps, uint count, uint random, float fine, float* rest) {
    uint low = 0u, high = count - 1u;
    while (low < high) {
        const uint middle = (low + high) >> 1u;
        if (steps[middle] >= random)
            high = middle;
        else
            low = middle + 1u;
    }
    const uint first = low == 0u ? 0u : steps[low - 1u] + 1u;
    *rest = fmin(((float)(random - first) + fine) / ((float)(steps[low] - first) + 1.0f), 0x1.fffffep-1f);
    return low;
}

static inline float3 rp_light_radiance(const __global rp_light* light) {
    return (float3)(light->radiance[0], light->radiance[1], light->radiance[2]);
}

// Density by solid angle of sampling a point at `distance` in `direction` on an emitter with surface that is chosen with this probability; negative
// if it does not shine that way.
static inline float rp_light_density(const __global rp_light* light, float probability, float3 normal, float3 direction, float distance) {
    float cosine = -dot(normal, direction);
    if (light->flags & RP_LIGHT_TWO_SIDED) cosine = fabs(cosine);
    return cosine > 0.0f ? probability * distance * distance / (cosine * light->area) : -1.0f;
}

#ifdef RP_LIGHT_TREE
#include "shading/light_tree.cl"
#endif

#define RP_LANES 1
#include "common/begin_lanes.cl"
#include "common/turns_lanes.cl"
#include "common/end_lanes.cl"
#undef RP_LANES
#if defined(RP_SKY) || defined(RP_LAMPS)
#include "shading/sky.cl"
#endif
#ifdef RP_LAMPS
#include "shading/lamp.cl"
#endif

#define RP_LANES 1
#include "shading/light_lanes.cl"
#undef RP_LANES

#endif
