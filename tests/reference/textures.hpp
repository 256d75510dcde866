// Textures of the reference tracer (abi/texture.h): programs in double precision. Images are interpolated between the texels of their finest level,
// so what is compared has to be seen from near.
#pragma once

#include <array>
#include <vector>

#include "raypager/scene.hpp"
#include "reference/vector.hpp"

namespace raypager::reference {

struct TextureSite {
    Vec3 position, normal;  // normal: unit
    double u = 0, v = 0;
};

class ReferenceTextures {
public:
    // Reads all images. REQUIRES: they can be read.
    explicit ReferenceTextures(const Scene& scene);
    // The material with its parameters as its program sets them here.
    rp_material at(const rp_material& material, const TextureSite& site) const;

private:
    struct Pixels {
        ImageShape shape;
        std::vector<std::array<double, 4>> texels;
    };
    Vec3 looked_up(const rp_texture_op& op, const TextureSite& site) const;
    Vec3 place(uint32_t map, const TextureSite& site) const;
    std::array<double, 4> texel(const Pixels& image, int64_t x, int64_t y, uint32_t wrap) const;

    const Scene& scene_;
    std::vector<Pixels> images_;
};

}  // namespace raypager::reference
