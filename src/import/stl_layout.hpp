// Which of its two forms an STL file has.
#pragma once

#include <string>

#include "base/files.hpp"

namespace raypager {

// Binary: 80 bytes, the number of triangles, then 50 bytes each: normal, three corners, two bytes of attributes.
inline constexpr uint64_t stl_header_bytes = 84, stl_triangle_bytes = 50;

struct StlLayout {
    bool binary = false;
    uint64_t triangles = 0;  // of binary ones
    std::string warning;     // where the header says something else; names the file
};

// Binary if the size is what the number of triangles says; else text if it looks like that; else binary, with as many triangles as the size allows,
// if their coordinates could be some. Anything else is an error.
Result<StlLayout> find_stl_layout(const InputFile& file);

}  // namespace raypager
