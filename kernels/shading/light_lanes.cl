// Points on lights (light.cl) on RP_LANES lanes.
#include "common/begin_lanes.cl"
#include "common/turns_lanes.cl"
#include "common/vector_lanes.cl"

typedef struct RP_NAME(rp_light_sample_) {
    RP_NAME(rp_vector_) direction;  // unit, from the shaded point
    RP_FLOATS reach;                // how far the way must be free: the distance, less what rounding may make of the emitter's own surface
    RP_NAME(rp_vector_) radiance;   // divided by the density of the sample
    // By solid angle, choice of the light included, as it is known where a BSDF sample hits the light: for weights alone. 0 for lights that none can
    // hit.
    RP_FLOATS density;
} RP_NAME(rp_light_sample_);

// A uniform direction.
static inline RP_NAME(rp_vector_) RP_NAME(rp_on_sphere_)(RP_FLOATS u, RP_FLOATS v) {
    const RP_FLOATS z = 1.0f - 2.0f * u, r = sqrt(rp_max(0.0f, 1.0f - z * z));
    RP_FLOATS sine, cosine;
    RP_NAME(rp_sincos_turns_)(v, &sine, &cosine);
    const RP_NAME(rp_vector_) d = {r * cosine, r * sine, z};
    return d;
}

// Power heuristic (Veach 1997) for one sample each.
static inline RP_FLOATS RP_NAME(rp_mis_weight_)(RP_FLOATS density, RP_FLOATS other) {
    const RP_FLOATS a = density * density, b = other * other;
    return isinf(a) ? (RP_FLOATS)(1.0f) : a / (a + b);
}

// Of each lane a light, chosen by bits.x (rp_choose_light, or with RP_LIGHT_TREE rp_choose_light_at), and a point on it. toward: the normal to which
// light comes in, if what it gives is in proportion to the cosine, or 0. The words of rp_light are
// taken as they lie: p and kind, e1 and flags, e2 and area, radiance and probability.
// Long, since in two pieces LLVM no longer inlines it where there is one lane.
static inline RP_NAME(rp_light_sample_) RP_NAME(rp_sample_light_)(const __global rp_light* lights, const __global uint* steps, uint light_count,
                                                                  RP_NAME(rp_vector_) point, RP_NAME(rp_vector_) toward, RP_NAME(rp_numbers_) bits) {
    uint number[RP_LANES], word[16][RP_LANES];
    float along[RP_LANES];
    RP_STORE(bits.x, number);
#ifdef RP_SKY
    uint across[RP_LANES];
    float of_sky[RP_LANES], digits[RP_LANES];
    RP_STORE(bits.y, across);
    RP_STORE(RP_NAME(rp_unit_)(bits.z), digits);
#endif
#if defined(RP_LIGHT_TREE) || defined(RP_LAMPS)
    float place[3][RP_LANES];
    RP_STORE(point.x, place[0]);
    RP_STORE(point.y, place[1]);
    RP_STORE(point.z, place[2]);
#endif
#ifdef RP_LIGHT_TREE
    uint more[RP_LANES];
    float facing[3][RP_LANES], chance[RP_LANES], weighed[RP_LANES];
    RP_STORE(bits.z, more);
    RP_STORE(toward.x, facing[0]);
    RP_STORE(toward.y, facing[1]);
    RP_STORE(toward.z, facing[2]);
#else
    float fine[RP_LANES];
    RP_STORE(RP_NAME(rp_unit_)(bits.z), fine);
#endif
    for (uint k = 0u; k < RP_LANES; k++) {
#ifdef RP_LIGHT_TREE
        const float3 here = (float3)(place[0][k], place[1][k], place[2][k]);
        const float3 normal = (float3)(facing[0][k], facing[1][k], facing[2][k]);
        const __global rp_light* light =
            lights + rp_choose_light_at(steps, lights, here, normal, number[k], more[k], along + k, chance + k, weighed + k);
#else
        const __global rp_light* light = lights + rp_choose_light(steps, light_count, number[k], fine[k], along + k);
#endif
        for (uint i = 0u; i < 4u; i++) {
            const uint4 row = vload4(i, (const __global uint*)light);
            word[4u * i][k] = row.x;
            word[4u * i + 1u][k] = row.y;
            word[4u * i + 2u][k] = row.z;
            word[4u * i + 3u][k] = row.w;
        }
#ifdef RP_LAMPS
        if (rp_is_lamp(light)) {
            const float3 away = (float3)(place[0][k], place[1][k], place[2][k]) - rp_load3(light->p);
            const float3 shines = rp_lamp_intensity(light, steps, away);
            word[12][k] = as_uint(shines.x);
            word[13][k] = as_uint(shines.y);
            word[14][k] = as_uint(shines.z);
        }
#endif
#ifdef RP_SKY
        // The one infinite light. What stood in the row of p were its axes.
        of_sky[k] = 0.0f;
        if (light->kind == RP_LIGHT_INFINITE) {
            const __global uint* sky = rp_sky_words(light, steps);
            const float2 place = rp_sample_sky(sky, across[k], along[k], digits[k], of_sky + k);
            const float3 towards = rp_sky_to_world(light, rp_sky_direction(place));
#ifdef RP_SKY_PAGED
            const float3 shines = (float3)(1.0f);  // what else it is has been looked up for the vertex (paged_sky.cl)
#else
            const float3 shines = rp_sky_radiance(sky, place);
#endif
            word[0][k] = as_uint(towards.x);
            word[1][k] = as_uint(towards.y);
            word[2][k] = as_uint(towards.z);
            word[12][k] = as_uint(shines.x);
            word[13][k] = as_uint(shines.y);
            word[14][k] = as_uint(shines.z);
        }
#endif
    }
    const RP_FLOATS u = RP_LOAD(along), v = RP_NAME(rp_unit_)(bits.y);
    const RP_NAME(rp_vector_) p = {RP_AS_FLOATS(RP_LOAD(word[0])), RP_AS_FLOATS(RP_LOAD(word[1])), RP_AS_FLOATS(RP_LOAD(word[2]))};
    const RP_NAME(rp_vector_) e1 = {RP_AS_FLOATS(RP_LOAD(word[4])), RP_AS_FLOATS(RP_LOAD(word[5])), RP_AS_FLOATS(RP_LOAD(word[6]))};
    const RP_NAME(rp_vector_) e2 = {RP_AS_FLOATS(RP_LOAD(word[8])), RP_AS_FLOATS(RP_LOAD(word[9])), RP_AS_FLOATS(RP_LOAD(word[10]))};
    const RP_NAME(rp_vector_) radiance = {RP_AS_FLOATS(RP_LOAD(word[12])), RP_AS_FLOATS(RP_LOAD(word[13])), RP_AS_FLOATS(RP_LOAD(word[14]))};
    const RP_UINTS kind = RP_LOAD(word[3]), flags = RP_LOAD(word[7]);
#ifdef RP_LIGHT_TREE
    const RP_FLOATS probability = RP_LOAD(chance);
#else
    const RP_FLOATS probability = RP_AS_FLOATS(RP_LOAD(word[15]));
#endif
    const RP_FLOATS area = RP_AS_FLOATS(RP_LOAD(word[11]));
    const RP_INTS triangle = kind == RP_LIGHT_TRIANGLE, sphere = kind == RP_LIGHT_SPHERE, infinite = kind == RP_LIGHT_INFINITE;
    const RP_INTS distant = kind == RP_LIGHT_DISTANT, surface = triangle | sphere;

    RP_NAME(rp_vector_) target = p, normal = {(RP_FLOATS)(0.0f), (RP_FLOATS)(0.0f), (RP_FLOATS)(0.0f)};
    if (RP_ANY(triangle)) {
        const RP_FLOATS root = sqrt(u), b1 = 1.0f - root, b2 = v * root;
        const RP_NAME(rp_vector_) across = RP_NAME(rp_plus_)(RP_NAME(rp_times_)(e1, b1), RP_NAME(rp_times_)(e2, b2));
        target = RP_NAME(rp_choose_)(triangle, RP_NAME(rp_plus_)(p, across), target);
        normal = RP_NAME(rp_choose_)(triangle, RP_NAME(rp_unit_vector_)(RP_NAME(rp_cross_)(e1, e2)), normal);
    }
#ifdef RP_SKY
    const RP_INTS in_direction = infinite | distant;
    const RP_FLOATS infinite_density = RP_LOAD(of_sky);
    if (RP_ANY(sphere)) {
#else
    const RP_INTS in_direction = distant;
    const RP_FLOATS infinite_density = (RP_FLOATS)(0.25f * RP_INV_PI);
    if (RP_ANY(sphere | infinite)) {
#endif
        const RP_NAME(rp_vector_) anywhere = RP_NAME(rp_on_sphere_)(u, v);
        target = RP_NAME(rp_choose_)(sphere, RP_NAME(rp_plus_)(p, RP_NAME(rp_times_)(anywhere, e1.x)), target);
        normal = RP_NAME(rp_choose_)(sphere | infinite, anywhere, normal);
    }
    const RP_NAME(rp_vector_) to_light = RP_NAME(rp_minus_)(target, point);
    const RP_FLOATS distance = sqrt(RP_NAME(rp_dot_)(to_light, to_light));
    RP_NAME(rp_light_sample_) s;
    s.direction = RP_NAME(rp_choose_)(in_direction, p, RP_NAME(rp_choose_)(infinite, normal, RP_NAME(rp_times_)(to_light, 1.0f / distance)));
    const RP_FLOATS towards = -RP_NAME(rp_dot_)(normal, s.direction), cosine = (flags & RP_LIGHT_TWO_SIDED) != 0u ? fabs(towards) : towards;
    const RP_FLOATS of_surface = cosine > 0.0f ? probability * distance * distance / (cosine * area) : (RP_FLOATS)(0.0f);
    const RP_FLOATS found = surface ? of_surface : infinite ? probability * infinite_density : (RP_FLOATS)(0.0f);
#ifdef RP_LIGHT_CLOSE
    const RP_FLOATS weighed_surface = cosine > 0.0f ? RP_LOAD(weighed) * distance * distance / (cosine * area) : (RP_FLOATS)(0.0f);
    const RP_FLOATS for_weight = surface ? weighed_surface : found;
#else
    const RP_FLOATS for_weight = found;
#endif
    s.density = (flags & RP_LIGHT_UNSEEN) != 0u ? (RP_FLOATS)(0.0f) : for_weight;
    // 2^-17 of the coordinates: dozens of roundings, so that rays that graze the emitter do not stop on it.
    const RP_FLOATS margin = 0x1p-17f * (RP_NAME(rp_largest_)(target) + distance);
    s.reach = (infinite | distant) ? (RP_FLOATS)(INFINITY) : surface ? distance - margin : distance;
    const RP_FLOATS weight = (surface | infinite) ? found : distant ? probability : probability * distance * distance;
    s.radiance = RP_NAME(rp_times_)(radiance, weight > 0.0f ? 1.0f / weight : (RP_FLOATS)(0.0f));
    return s;
}

#include "common/end_lanes.cl"
