// Images for textures (Scene::images), from files and from memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// A file, which is opened when its shape is asked for, and when it is read. Binary PPM and PGM (8 and 16 bits) and PFM are read always, everything
// else with OpenImageIO (use_openimageio in picture.hpp), tiled files and those with levels of their own included, of which level 0 is read.
// Of more than four channels the first four are taken, of two the first is grey and the second alpha, to three comes an alpha of 1. Integers that are
// sRGB of 16 bits or gamma-encoded come as linear ones of 16 bits, floats as halves: what these cannot hold becomes the nearest that they can, NaN
// becomes 0, and a warning counts both.
std::shared_ptr<const ImageSource> image_file_source(const std::filesystem::path& path, const ImageEncoding& encoding = {});

// A picture's file that is a part of another, and in memory: `size` bytes. ending: of what format it is (".png"); name: for messages. With
// OpenImageIO alone.
std::shared_ptr<const ImageSource> embedded_image(std::string name, std::string ending, std::shared_ptr<const std::byte[]> bytes, size_t size,
                                                  const ImageEncoding& encoding = {});

// REQUIRES: as many texels as the shape has, row by row.
std::shared_ptr<const ImageSource> memory_image(std::string name, const ImageShape& shape, std::vector<std::byte> texels);

}  // namespace raypager
