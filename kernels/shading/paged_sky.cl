// Skies whose texels are in pages (abi/light_image.h). As textures do (texture.cl), a lookup takes one texel, chosen by random numbers so that the
// mean is what is between texels, and where its page is absent the path waits where it has arrived.
//
// Camera rays, and what is mirrored or refracted, see the image as it is. Surfaces that scatter light see one level of it, by rays and by connections
// alike: what both find is weighed against each other, and beside the edge of something bright they must find the same.
#ifndef RP_PAGED_SKY_CL
#define RP_PAGED_SKY_CL

#include "shading/scatter.cl"
#include "shading/texture.cl"

// The texel at a place of a level, from -1 to one behind the last along each axis. All bytes are good ones, so that the exponent has to be kept in
// bounds here.
static inline bool rp_look_at_sky(const rp_textures* t, const __global uint* sky, float2 place, uint level, const rp_numbers_1* bits, float3* color,
                                  uint* absent) {
    const __global rp_image* image = (const __global rp_image*)(t->words + t->at->images) + sky[RP_IMAGE_IN_PAGES];
    const uint4 record = ((const __global uint4*)(t->words + t->at->image_levels))[image->first_level + level];  // rp_image_level
    const float size = (float)record.y;
    const int x = (int)floor(rp_add(rp_mul(place.x, size), rp_unit_1(bits->x) - 0.5f));
    const int y = (int)floor(rp_add(rp_mul(place.y, size), rp_unit_1(bits->y) - 0.5f));
    const int2 texel = rp_sky_folded(x, y, (int)record.y);
    const rp_texel_address address = rp_texel_of_level(record, RP_TEXEL_LOG_BYTES(RP_TEXEL_SKY), (uint)texel.x, (uint)texel.y);
    const uint page = t->at->first_page + address.page, where = t->geometry->pages[page].x;
    if (where == RP_NONE) {
        *absent = page;
        return false;
    }
    rp_note_texture_page(t, page, bits->z);
    const uint2 words = *(const __global uint2*)(rp_block_address(t->geometry, where) + address.at);
    *color = rp_texel_color(words, min(words.y >> 16, RP_TEXEL_MAX_EXPONENT));
    return true;
}

static inline rp_numbers_1 rp_sky_bits(__constant rp_render_params* params, const rp_arrival* a) {
    return rp_random_bits_1(a->pixel, a->sample, rp_depth_of(a->flags) + 1u, RP_RANDOM_SKY, params->seed);
}

// What a path sees that has met nothing. False: the page *absent (in the page table) is not there.
static inline bool rp_see_sky(const rp_textures* t, __constant rp_render_params* params, const rp_arrival* a, float3* seen, uint* absent) {
    const __global rp_light* light = t->lights + params->infinite_light;
    const __global uint* sky = rp_sky_words(light, t->light_steps);
    const float2 place = rp_sky_place(rp_sky_from_world(light, a->direction));
    const bool full = rp_was_specular(a->flags);
    const rp_numbers_1 bits = rp_sky_bits(params, a);
    float3 color;
    if (!rp_look_at_sky(t, sky, place, full ? 0u : sky[RP_IMAGE_LEVEL], &bits, &color, absent)) return false;
    *seen = color * (full ? 1.0f : rp_mis_weight_1(a->bsdf_density, light->probability * rp_sky_density(sky, place)));
    return true;
}

// The light that a vertex connects to, if that is the sky, or RP_NONE; by the same numbers as rp_sample_light. along: as of rp_choose_light.
static inline uint rp_chosen_sky(const rp_textures* t, __constant rp_render_params* params, const rp_numbers_1* bits, float* along) {
    const __global uint* steps = t->light_steps;
    const float fine = rp_unit_1(bits->z);
#ifdef RP_LIGHT_TREE
    const uint choice = rp_choose_light(steps + steps[RP_LIGHT_TREE_STEPS], steps[RP_LIGHT_TREE_COUNT], bits->x, fine, along);
    const uint light = choice != 0u ? steps[steps[RP_LIGHT_TREE_OTHERS] + choice - 1u] : RP_NONE;
#else
    const uint light = rp_choose_light(steps, params->light_count, bits->x, fine, along);
#endif
    return light == params->infinite_light ? light : RP_NONE;
}

// Whether a connection that goes that way surely brings nothing, so that no page need be there for it.
static inline bool rp_is_behind(const rp_material* material, const rp_arrival* a, float3 direction) {
    if (rp_is_specular(material)) return true;
    if (material->kind == RP_MATERIAL_LAYERED) return false;  // may shine through
    const float3 normal = rp_decode_normal(a->geometric_normal);
    const float towards = dot(normal, direction);
    return (dot(normal, a->direction) > 0.0f ? -towards : towards) < -1e-3f;
}

// What the sky shines as where the vertex of a path connects to it; 1 if it connects to another light.
static inline bool rp_connect_to_sky(const rp_textures* t, __constant rp_render_params* params, const rp_arrival* a, const rp_material* material,
                                     rp_vector_1* color, uint* absent) {
    *color = rp_vector_of((float3)(1.0f));
    const rp_numbers_1 bits = rp_random_bits_1(a->pixel, a->sample, rp_depth_of(a->flags) + 1u, RP_RANDOM_LIGHT, params->seed);
    float along, density;
    const uint number = rp_chosen_sky(t, params, &bits, &along);
    if (number == RP_NONE) return true;
    const __global rp_light* light = t->lights + number;
    const __global uint* sky = rp_sky_words(light, t->light_steps);
    const float2 place = rp_sample_sky(sky, bits.y, along, rp_unit_1(bits.z), &density);
    if (rp_is_behind(material, a, rp_sky_to_world(light, rp_sky_direction(place)))) return true;
    const rp_numbers_1 texel_bits = rp_sky_bits(params, a);
    float3 found;
    if (!rp_look_at_sky(t, sky, place, sky[RP_IMAGE_LEVEL], &texel_bits, &found, absent)) return false;
    *color = rp_vector_of(found);
    return true;
}

#endif
