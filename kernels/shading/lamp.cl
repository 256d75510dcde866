// Lights at a point that do not shine alike in all directions: cones, images of all directions, and projections.
#ifndef RP_LAMP_CL
#define RP_LAMP_CL

static inline bool rp_is_lamp(const __global rp_light* light) {
    return light->kind >= RP_LIGHT_SPOT || (light->kind == RP_LIGHT_POINT && light->flags >> RP_LIGHT_IMAGE_SHIFT != 0u);
}

// Beyond its edges there is no light.
static inline float3 rp_projected(const __global uint* image, float2 place) {
    if (!(place.x >= 0.0f && place.x <= 1.0f && place.y >= 0.0f && place.y <= 1.0f)) return (float3)(0.0f);
    const int last_x = (int)image[RP_IMAGE_WIDTH] - 1, last_y = (int)image[RP_IMAGE_HEIGHT] - 1;
    const float2 at = place * (float2)((float)(last_x + 1), (float)(last_y + 1)) - 0.5f, corner = floor(at), f = at - corner;
    const int x = (int)corner.x, y = (int)corner.y;
    const int left = max(x, 0), right = min(x + 1, last_x), top = max(y, 0), bottom = min(y + 1, last_y);
    const float3 upper = rp_image_texel(image, left, top) * (1.0f - f.x) + rp_image_texel(image, right, top) * f.x;
    const float3 lower = rp_image_texel(image, left, bottom) * (1.0f - f.x) + rp_image_texel(image, right, bottom) * f.x;
    return upper * (1.0f - f.y) + lower * f.y;
}

// Intensity of a lamp towards a place that is so far from it.
static inline float3 rp_lamp_intensity(const __global rp_light* light, const __global uint* light_steps, float3 away) {
    const float3 e1 = rp_load3(light->e1), e2 = rp_load3(light->e2), intensity = rp_light_radiance(light);
    const float distance = sqrt(away.x * away.x + away.y * away.y + away.z * away.z);
    const float3 d = away * (1.0f / distance);
    if (light->kind == RP_LIGHT_SPOT) {
        const float above = dot(e1, d) - e2.x, t = above > 0.0f ? rp_min(above / rp_max(e2.y - e2.x, 1e-7f), 1.0f) : 0.0f, t2 = t * t;
        return intensity * (e2.z != 0.0f ? t2 * t2 : t2 * (3.0f - 2.0f * t));
    }
    const __global uint* image = rp_sky_words(light, light_steps);
    const float3 third = cross(e1, e2) * (light->flags & RP_LIGHT_MIRRORED ? -1.0f : 1.0f);
    if (light->kind == RP_LIGHT_POINT) return intensity * rp_sky_radiance(image, rp_sky_place((float3)(dot(e1, d), dot(e2, d), dot(third, d))));
    // third is as long as the product of the other two, which are at right angles.
    const float depth = dot(third, d);
    if (!(depth > 0.0f)) return (float3)(0.0f);
    const float s1 = dot(e1, e1), s2 = dot(e2, e2), size = sqrt(s1 * s2);
    const float x = dot(e1, d) * size / (s1 * depth), y = dot(e2, d) * size / (s2 * depth);
    return intensity * rp_projected(image, (float2)(0.5f + 0.5f * x, 0.5f - 0.5f * y));
}

#endif
