// Images of what a museum is made of: stone, plaster, wood, leaves, and how rough these are. All but leaves can be laid side by side.
#pragma once

#include <memory>

#include "procedural/image_painter.hpp"

namespace raypager {

enum class Covering : uint8_t { tiles, worn_tiles, plaster, planks, marble, clay, leaf, leaf_mask, brushed };
constexpr bool is_grey(Covering covering) {
    return covering == Covering::worn_tiles || covering == Covering::leaf_mask || covering == Covering::brushed;
}

// Leaves and masks of one seed belong together.
std::unique_ptr<ImagePainter> make_covering(Covering covering, uint32_t width, uint32_t height, uint64_t seed);

}  // namespace raypager
