// What is looked at in an OpenEXR file before a library reads it.
#pragma once

#include "base/files.hpp"
#include "raypager/status.hpp"

namespace raypager {

// An error if an attribute of a header promises more bytes than the file has: the OpenEXR library takes memory for them first and finds out
// afterwards. Everything else, other formats included, is left to the library. Format: "OpenEXR File Layout", openexr.com.
Status check_exr_attributes(const InputFile& file);

}  // namespace raypager
