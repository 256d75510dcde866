// What is looked at in a picture's file before a library reads it: sizes that libraries take memory for first and look for afterwards. A part
// that claims more bytes than its file has is an error; everything else, other formats included, is left to the library.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "base/files.hpp"
#include "raypager/status.hpp"

namespace raypager {

// A picture's file, on the disk or in memory.
struct SizedBytes {
    std::string name;
    uint64_t size = 0;
    std::function<Status(uint64_t offset, std::span<std::byte> bytes)> read;
};
SizedBytes bytes_of_file(const InputFile& file);                                        // REQUIRES: it lives as long
SizedBytes bytes_in_memory(const std::string& name, std::span<const std::byte> bytes);  // likewise

// Attributes in the headers of an OpenEXR file. Format: "OpenEXR File Layout", openexr.com.
Status check_exr_attributes(const SizedBytes& file);

// Chunks of a PNG file. Format: "Portable Network Graphics (PNG) Specification", W3C, section 5.
Status check_png_chunks(const SizedBytes& file);

}  // namespace raypager
