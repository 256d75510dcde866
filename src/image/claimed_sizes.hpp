// What is looked at in a picture's file before a library reads it: sizes that libraries take memory for first and look for afterwards. A part
// that claims more bytes than its file has is an error; everything else, other formats included, is left to the library.
#pragma once

#include "base/files.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Attributes in the headers of an OpenEXR file. Format: "OpenEXR File Layout", openexr.com.
Status check_exr_attributes(const InputFile& file);

// Chunks of a PNG file. Format: "Portable Network Graphics (PNG) Specification", W3C, section 5.
Status check_png_chunks(const InputFile& file);

}  // namespace raypager
