// The images of lights as kernels have them, behind the words by which lights are chosen (abi/light_image.h).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

// sky_in_pages: the words of a sky whose texels are in pages, and are not in `images`; empty if there is none.
uint64_t image_words_bytes(const LightImages& images, std::span<const rp_light> lights, std::span<const uint32_t> sky_in_pages = {});

// The words of each image one after the other: what comes before its texels, then these. first_word: of the first image. Afterwards lights with an
// image know where it lies.
Status for_image_words(const LightImages& images, std::vector<rp_light>& lights, uint64_t first_word,
                       const std::function<Status(std::span<const uint32_t> head, std::span<const rp_texel> texels)>& take,
                       std::span<const uint32_t> sky_in_pages = {});

// What comes before the texels of a sky. image: all of it, or for a sky in pages the level that directions are drawn from.
std::vector<uint32_t> sky_head(const LightImage& image);

// Cells a side of a sky so large.
uint32_t sky_cells(uint32_t size);
// Whether these may be the words of a sky in pages: kernels find a cell for every number.
bool are_sky_words(std::span<const uint32_t> words);

// How bright the parts of an image of all directions are: the integral over each of cells x cells of what is seen there, up to a factor, row by row.
std::vector<double> cell_weights(const LightImage& image, uint32_t cells);

}  // namespace raypager
