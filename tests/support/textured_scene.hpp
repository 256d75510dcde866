// Scenes whose materials read images, for tests of what carries these.
#pragma once

#include <algorithm>
#include <cstring>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/half.hpp"
#include "raypager/image_source.hpp"
#include "scene/image_levels.hpp"

namespace raypager::support {

inline std::shared_ptr<const ImageSource> random_image(const ImageShape& shape, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<std::byte> texels(uint64_t{shape.width} * shape.height * shape.channels * bytes_of_channel(shape.kind));
    for (std::byte& byte : texels) byte = static_cast<std::byte>(random());
    for (size_t i = 0; shape.kind == TexelKind::half && i < texels.size(); i += 2) {
        const uint16_t half = half_of(static_cast<float>(random() % 1000) / 500);
        std::memcpy(texels.data() + i, &half, sizeof half);
    }
    return memory_image("image " + std::to_string(seed), shape, std::move(texels));
}

// Gives material 0 a program that sets its colour to a product of all images. `lookup` of each: behind the one before it.
inline void add_image_program(Scene& scene, const std::vector<uint32_t>& images) {
    scene.materials[0].flags |= static_cast<uint32_t>(scene.texture_ops.size() + 1) << RP_MATERIAL_PROGRAM_SHIFT;
    uint32_t lookup = 0;
    for (const uint32_t image : images) {
        scene.texture_ops.push_back({RP_TEXTURE_IMAGE, image, lookup, image % 2 ? RP_NONE : 0, {1, 1, 1, 1}, {}});
        lookup += texel_words(format_of(*scene.images[image]->shape()));
        if (image != images.front()) scene.texture_ops.push_back({RP_TEXTURE_SCALE, 0, 0, 0, {1, 1, 1, 1}, {}});
    }
    scene.texture_ops.push_back({RP_TEXTURE_SET | RP_TEXTURE_LAST, RP_PARAMETER_COLOR, 0, 0, {}, {}});
}

// Every format of texels, 8 bits also as sRGB.
inline std::vector<ImageShape> shapes_of_all_formats(uint32_t width, uint32_t height) {
    std::vector<ImageShape> shapes;
    for (const uint32_t channels : {1u, 4u}) {
        for (const TexelKind kind : {TexelKind::unsigned_8, TexelKind::unsigned_16, TexelKind::half})
            shapes.push_back({width, height, channels, kind, false});
        shapes.push_back({width, height, channels, TexelKind::unsigned_8, true});
    }
    return shapes;
}

// A program that makes a material grey, as the scene's only one.
inline void set_grey_program(Scene& scene) {
    scene.texture_ops.resize(2);
    scene.texture_ops[0].op = RP_TEXTURE_CONSTANT;
    std::fill_n(scene.texture_ops[0].a, 3, 0.5f);
    scene.texture_ops[1].op = RP_TEXTURE_SET | RP_TEXTURE_LAST;
    scene.texture_ops[1].image = RP_PARAMETER_COLOR;
    for (rp_texture_op& op : scene.texture_ops) op.map = RP_NONE;
}

// Six images of all sizes and formats, of which the third is not used: some are tails alone, some have levels of several tiles.
inline Scene with_images(Scene scene, uint32_t seed = 1) {
    scene.images = {
        random_image({300, 200, 4, TexelKind::unsigned_8, true}, seed),    random_image({33, 64, 1, TexelKind::unsigned_8, true}, seed + 1),
        random_image({50, 50, 1, TexelKind::unsigned_8, false}, seed + 2), random_image({400, 130, 1, TexelKind::unsigned_16, false}, seed + 3),
        random_image({129, 65, 4, TexelKind::half, false}, seed + 4),      random_image({1, 1, 4, TexelKind::unsigned_16, false}, seed + 5)};
    scene.texture_maps = {{RP_MAP_UV, 0, {}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}, {1, 1}, {0, 0}}};
    add_image_program(scene, {0, 1, 3, 4, 5});
    return scene;
}

}  // namespace raypager::support
