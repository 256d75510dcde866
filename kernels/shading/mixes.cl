// Mixes of materials: which of its parts a sample meets.
#ifndef RP_MIXES_CL
#define RP_MIXES_CL

#include "common/random.cl"
#include "shading/ggx.cl"

#ifdef RP_LAYERED
// Random numbers that choose from mixes: one for each within another.
static inline uint4 rp_mix_numbers(__constant rp_render_params* params, uint pixel, uint sample, uint depth, uint purpose) {
    const rp_numbers_1 bits = rp_random_bits_1(pixel, sample, depth + 1u, purpose, params->seed);
    return (uint4)(bits.x, bits.z, bits.y, bits.w);
}
static inline uint rp_chosen_of_mix(RP_MATERIAL_SPACE const rp_material* mix, uint4 numbers, uint i) {
    const uint mine = i == 0u ? numbers.x : i == 1u ? numbers.y : i == 2u ? numbers.z : numbers.w;
    return rp_unit_1(mine) < mix->amount ? mix->second : mix->first;
}
#endif
#if defined(RP_LAYERED) && !defined(RP_TEXTURES)
// The material with this number, or if that is a mix, the one of its parts that this sample meets.
static inline const __global rp_material* rp_of_mix(__constant rp_render_params* params, const __global rp_material* materials, uint number,
                                                    uint pixel, uint sample, uint depth) {
    if (materials[number].kind != RP_MATERIAL_MIX) return materials + number;
    const uint4 numbers = rp_mix_numbers(params, pixel, sample, depth, RP_RANDOM_MIX);
    for (uint i = 0u; i < RP_MAX_MIXES && materials[number].kind == RP_MATERIAL_MIX; i++) {
#ifdef RP_TRAITS
        const rp_material mix = materials[number];
        number = rp_chosen_of_mix(&mix, numbers, i);
#else
        number = rp_chosen_of_mix(materials + number, numbers, i);
#endif
    }
    return materials + number;
}
#endif

#endif
