// What both ways of reading through OpenImageIO need.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <memory>
#include <string>

#include "image/formats.hpp"

namespace raypager {

// libpng and its like write to stderr when a file is damaged, although the library above them reports the same: one error is one line.
// What other threads write meanwhile is lost, too, so this is held for as long as the library is at work, no longer. Any number at once.
class SilentStderr {
public:
    SilentStderr();
    ~SilentStderr();
    SilentStderr(const SilentStderr&) = delete;
    SilentStderr& operator=(const SilentStderr&) = delete;
};

// One line of a library's message.
std::string one_line(std::string text);

// Whether a file claims more bytes than those that it has can be unpacked to, as far as that can be told.
bool claims_too_much(const OIIO::ImageSpec& spec, const std::string& format, uint64_t file_bytes);

// Opened by the reader of its ending; an error names the file. config: of OpenImageIO's readers.
Result<std::unique_ptr<OIIO::ImageInput>> open_image_input(const std::filesystem::path& path, const OIIO::ImageSpec& config);

// The same of one in memory, which bytes read.
Result<std::unique_ptr<OIIO::ImageInput>> open_image_input(const EmbeddedPicture& picture, OIIO::Filesystem::IOProxy& bytes,
                                                           const OIIO::ImageSpec& config);

Result<std::unique_ptr<ImageRows>> open_embedded_rows_with_openimageio(const EmbeddedPicture& picture, const ImageEncoding& encoding);
Result<std::unique_ptr<ImageRows>> open_rows_with_openimageio(const std::filesystem::path& path, const ImageEncoding& encoding);

}  // namespace raypager
