// Where the levels of images lie: known from their shapes, before a texel is read.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "raypager/abi/texture.h"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct ImageLayout {
    std::vector<rp_image> images;
    std::vector<rp_image_level> levels;
    uint32_t pages = 0;
    // The pages that tails share are the first; of each, how many images have their tail there.
    std::vector<uint32_t> tails;
};

// An error if the shape cannot be: no texels, more than RP_IMAGE_MAX_SIZE along an axis, channels other than 1 and 4. name: of the image.
Status check_image_shape(const ImageShape& shape, const std::string& name);

// The images one after the other. REQUIRES: shapes that check_image_shape accepts. An error if there are more pages than a page table can number.
Result<ImageLayout> lay_out_images(std::span<const ImageShape> shapes);

}  // namespace raypager
