// The readers and writers behind image.hpp, one a file format or library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "raypager/picture.hpp"
#include "raypager/scene.hpp"

namespace raypager {

constexpr uint64_t max_image_pixels = uint64_t{1} << 28;
// Pictures are read row by row, and what a damaged file promises for one row is taken before its end is seen.
constexpr uint64_t max_image_side = uint64_t{1} << 20;

// ".png" of "A.PNG".
std::string lower_case_ending(const std::filesystem::path& path);

// An error if a picture of this size is empty or larger than is accepted. To be asked before anything is allocated.
Status check_image_size(const std::filesystem::path& path, uint64_t width, uint64_t height);

// The same for an image of a texture, which is never in memory as a whole.
Status check_texture_size(const std::filesystem::path& path, uint64_t width, uint64_t height);

// Portable float map: three channels (PF) or one (Pf), either byte order; rows in the file run from bottom to top. The scale factor
// in the header multiplies the values unless raw. The file must have exactly the size that its header says.
Result<Image> read_pfm(const std::filesystem::path& path, bool raw);
// Little-endian, scale 1; every value comes back bit for bit.
Status write_pfm(const std::filesystem::path& path, const Image& image);

// Display encoding of IEC 61966-2-1, and back. encode clamps to [0, 1]; a NaN becomes 0.
uint8_t encode_srgb8(float linear);
float decode_srgb(float encoded);

// An image file that is open, as texels (ImageSource).
class ImageRows {
public:
    virtual ~ImageRows() = default;
    virtual const ImageShape& shape() const = 0;
    // Once.
    virtual Status read(const std::function<Status(std::span<const std::byte> rows)>& take) = 0;
};

// Binary portable maps of grey or colours, and float maps; null if the file is none of these.
Result<std::unique_ptr<ImageRows>> open_portable_rows(const std::filesystem::path& path, const ImageEncoding& encoding);

// A picture's file that is part of another and in memory. Its ending says of what format it is: ".png".
struct EmbeddedPicture {
    std::string name, ending;
    std::span<const std::byte> bytes;
};

// For pictures in other formats: a library that the program brings with it.
struct ImageLibrary {
    // By the file's ending. Alpha and further channels are left out: the picture has one channel or three.
    Result<Image> (*read)(const std::filesystem::path& path, bool raw);
    // .exr and .png. channels: their names; empty: R, G, B and A, or one for grey.
    Status (*write)(const std::filesystem::path& path, const Image& image, const std::vector<std::string>& channels);
    Result<std::unique_ptr<ImageRows>> (*open_rows)(const std::filesystem::path& path, const ImageEncoding& encoding);
    // REQUIRES: the bytes stay as long as what is opened.
    Result<std::unique_ptr<ImageRows>> (*open_embedded_rows)(const EmbeddedPicture& picture, const ImageEncoding& encoding);
};
// From now on; there is none at first. To be called before other threads read or write pictures.
void use_image_library(const ImageLibrary& library);
const ImageLibrary* used_image_library();  // null: none

}  // namespace raypager
