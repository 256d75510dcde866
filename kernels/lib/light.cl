// Next-event estimation: choose a light, sample a point on it; and the density with which that would have found a given emitter.
#ifndef RP_LIGHT_CL
#define RP_LIGHT_CL

#include "lib/bsdf.cl"

typedef struct rp_light_sample {
    float3 direction;  // unit, from the shaded point
    float distance;    // INFINITY for infinite and distant lights
    float reach;       // how far the way must be free: the distance, less what rounding may make of the emitter's own surface
    float3 radiance;   // divided by the density of the sample
    float density;     // by solid angle, choice of the light included; 0 for lights that no BSDF sample can hit
} rp_light_sample;

// The light that a uniform 32-bit random number chooses: steps[i] is the last one of light i. (A float could not tell many lights apart.)
static inline uint rp_choose_light(const __global uint* steps, uint count, uint random) {
    uint low = 0u, high = count - 1u;
    while (low < high) {
        const uint middle = (low + high) >> 1u;
        if (steps[middle] >= random) high = middle;
        else low = middle + 1u;
    }
    return low;
}

static inline float3 rp_light_radiance(const __global rp_light* light) { return (float3)(light->radiance[0], light->radiance[1], light->radiance[2]); }

// Density by solid angle of sampling a point at `distance` in `direction` on an emitter with surface; 0 if it does not shine that way.
static inline float rp_light_density(const __global rp_light* light, float3 normal, float3 direction, float distance) {
    float cosine = -dot(normal, direction);
    if (light->flags & RP_LIGHT_TWO_SIDED) cosine = fabs(cosine);
    return cosine > 0.0f ? light->probability * distance * distance / (cosine * light->area) : 0.0f;
}

static inline rp_light_sample rp_sample_light(const __global rp_light* light, float3 point, float2 u) {
    rp_light_sample s;
    s.radiance = rp_light_radiance(light);
    s.density = 0.0f;
    s.distance = s.reach = INFINITY;
    const float3 p = rp_load3(light->p);
    if (light->kind == RP_LIGHT_DISTANT) {
        s.direction = p;
        s.radiance /= light->probability;
        return s;
    }
    if (light->kind == RP_LIGHT_INFINITE) {
        const float z = 1.0f - 2.0f * u.x, r = sqrt(fmax(0.0f, 1.0f - z * z));
        float cosine;
        const float sine = sincos(2.0f * RP_PI * u.y, &cosine);
        s.direction = (float3)(r * cosine, r * sine, z);
        s.density = light->probability * (0.25f * RP_INV_PI);
        s.radiance /= s.density;
        return s;
    }
    float3 target = p, normal = (float3)(0.0f);
    if (light->kind == RP_LIGHT_TRIANGLE) {
        const float root = sqrt(u.x), b1 = 1.0f - root, b2 = u.y * root;
        const float3 e1 = rp_load3(light->e1), e2 = rp_load3(light->e2);
        target = p + b1 * e1 + b2 * e2;
        normal = normalize(cross(e1, e2));
    } else if (light->kind == RP_LIGHT_SPHERE) {
        const float z = 1.0f - 2.0f * u.x, r = sqrt(fmax(0.0f, 1.0f - z * z));
        float cosine;
        const float sine = sincos(2.0f * RP_PI * u.y, &cosine);
        normal = (float3)(r * cosine, r * sine, z);
        target = p + light->e1[0] * normal;
    }
    const float3 to_light = target - point;
    const float distance = sqrt(dot(to_light, to_light));
    s.direction = to_light / distance;
    s.distance = distance;
    if (light->kind == RP_LIGHT_POINT) {
        s.reach = distance;
        s.radiance /= light->probability * distance * distance;
        return s;
    }
    // 2^-17 of the coordinates: dozens of roundings, so that rays that graze the emitter do not stop on it.
    const float largest = rp_max(rp_max(fabs(target.x), fabs(target.y)), fabs(target.z));
    s.reach = distance - 0x1p-17f * (largest + distance);
    s.density = rp_light_density(light, normal, s.direction, distance);
    s.radiance = s.density > 0.0f ? s.radiance / s.density : (float3)(0.0f);
    return s;
}

// Power heuristic (Veach 1997) for one sample each.
static inline float rp_mis_weight(float density, float other) {
    const float a = density * density, b = other * other;
    return isinf(a) ? 1.0f : a / (a + b);
}

#endif
