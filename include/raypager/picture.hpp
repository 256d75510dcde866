// Pictures, in memory and in files. PFM is read and written always, everything else through OpenImageIO, where a program uses it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

// Rows from top to bottom, channels interleaved, linear light. Of four channels the last is alpha, and colours are multiplied by it.
struct Image {
    uint32_t width = 0, height = 0, channels = 3;
    std::vector<float> values;  // width * height * channels
};

// By the ending of the path: .pfm always; .exr (32-bit float, linear), .png (8 bit, sRGB) and others with OpenImageIO.
// Refuses images of more than 2^28 pixels, or 2^20 a side. Integer images: divided by their maximum unless raw (then: the stored numbers).
Result<Image> read_image(const std::filesystem::path& path, bool raw = false);
// The file appears whole or not at all. Four channels: .exr and .png alone.
Status write_image(const std::filesystem::path& path, const Image& image);
// Whether pictures with this ending can have an alpha channel.
bool holds_alpha(const std::filesystem::path& path);
// Colours times 2^stops; alpha stays.
void expose(Image& image, double stops);
// Refused up front, before hours of rendering: an error if no writer knows the ending or the folder does not exist.
Status check_writable_image(const std::filesystem::path& path);

struct ImageDifference {
    double rmse = 0;          // root of the mean over pixels and channels of (a - b)^2
    double relative_mse = 0;  // mean of (a - b)^2 / (b^2 + 0.01); b is the reference
    double max_difference = 0;
};
// Usage error if the sizes differ.
Result<ImageDifference> compare_images(const Image& a, const Image& b);

// With OpenImageIO (the target raypager::openimageio): from now on pictures are read and written by it, but for .pfm. To be called before other
// threads read or write pictures.
void use_openimageio();

}  // namespace raypager
