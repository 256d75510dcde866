// Pictures on their way to the page, and into files that its user saves.
#pragma once

#include <string>

#include "raypager/picture.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Red, green and blue of each pixel as halves (IEEE 754 binary16, least significant byte first), linear light: what the page exposes by itself, with
// a table of all halves. Of pictures with alpha the colours, before black.
std::string half_pixels(const Image& image);

// The contents of a file with this ending, ".png" or ".exr".
Result<std::string> file_contents(const Image& image, const std::string& ending);

}  // namespace raypager
