// What holds of every texture program that is run, whoever made it: kernels run them as they are.
#pragma once

#include <functional>
#include <span>

#include "raypager/abi/scene.h"
#include "raypager/abi/texture.h"
#include "raypager/status.hpp"

namespace raypager {

// More than these octaves of noise are beyond what floats tell apart.
inline constexpr float max_octaves = 32;

// The first operation of a material's program, or RP_NONE.
inline uint32_t program_of(const rp_material& material) { return (material.flags >> RP_MATERIAL_PROGRAM_SHIFT) - 1; }

struct TexturePrograms {
    std::span<const rp_texture_op> ops;
    std::span<const rp_texture_map> maps;
    std::span<const rp_material> materials;
    size_t images = 0;
    // Of a path slot, that a texel of an image takes; empty where the images have not been looked at yet: then each takes at least one.
    std::function<uint32_t(uint32_t image)> texel_words = {};
};

// Operations, their flags and what they name; numbers are finite; no stack has less than nothing on it, nor more than RP_TEXTURE_STACK; the texels of
// a program lie beside each other, those of the same place of an image excepted; programs end, and materials name the beginning of one that sets
// what they have.
Status check_textures(const TexturePrograms& programs);

}  // namespace raypager
