// An image into its levels and these into pages, while its rows come in: no more than a row of tiles of each level is in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "raypager/abi/texture.h"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "scene/image_levels.hpp"
#include "texture/texel_codec.hpp"

namespace raypager {

// Where pages go. A status that is not ok ends the work and is passed on.
struct PageTakers {
    std::function<Status(uint32_t page, std::span<const std::byte> bytes)> page;
    // All small levels of an image: a part of a page, which begins at the byte `at`.
    std::function<Status(uint32_t page, uint32_t at, std::span<const std::byte> bytes)> tail;
    // Each row of each level, as it is stored; may be empty.
    std::function<void(uint32_t level, std::span<const std::byte> texels)> row = {};
};

// A texel of a level is the mean of the area that it covers of the level before, n texels along an axis becoming m = (n + 1) / 2: texel i
// covers [i n / m, (i + 1) n / m). Means are of linear values. Between levels they are not rounded to the texels' format.
class ImageTiler {
public:
    // name: of the image, for messages.
    ImageTiler(std::string name, const rp_image& image, std::span<const rp_image_level> levels, PageTakers takers);
    // Rows from top to bottom, whole ones; channels as the image's format has them.
    Status take(std::span<const std::byte> rows);
    // An error if rows are missing.
    Status finish();
    uint32_t rows_taken() const { return levels_.front().rows; }
    // That it takes, about.
    static uint64_t memory_bytes(const ImageShape& shape);

private:
    struct Level {
        rp_image_level record;
        uint32_t rows = 0;             // so many have come
        std::vector<std::byte> band;   // the tiles of the row of tiles at hand; of a level of the tail all of it
        std::vector<float> sums[2];    // of rows of the next level that are being made: the one at hand, and the one behind it
        std::vector<float> half_wide;  // a row, as wide as the next level
    };
    bool is_last(size_t level) const { return level + 1 == levels_.size(); }
    Status put_row(size_t level, const std::byte* texels);
    Status hand_on(size_t level, const float* values);
    Status finish_row_of_next(size_t level);
    Status put_pages(Level& level);

    const std::string name_;
    const rp_image image_;
    const TexelCodec codec_;
    const TileShape tile_;
    const PageTakers takers_;
    std::vector<Level> levels_;
    std::vector<uint32_t> morton_x_, morton_y_;
    std::vector<float> values_;      // of a row of level 0
    std::vector<std::byte> texels_;  // of a row, encoded
};

// Reads the image from its source and takes it through a tiler. before_rows is asked each time that rows come; a status that is not ok ends it.
Status tile_image(const ImageSource& source, const rp_image& image, std::span<const rp_image_level> levels, PageTakers takers,
                  const std::function<Status(uint32_t rows_before)>& before_rows = {});

}  // namespace raypager
