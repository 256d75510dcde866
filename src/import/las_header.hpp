// The header of a LAS file, checked against the file.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "base/files.hpp"

namespace raypager {

static_assert(std::endian::native == std::endian::little, "LAS is decoded on little-endian machines only");

// A value as a LAS file stores it.
template <class T>
T load_las(const std::byte* from) {
    T value;
    std::memcpy(&value, from, sizeof(T));
    return value;
}

struct LasHeader {
    uint8_t minor_version = 0;                      // of 1.x
    uint8_t format = 0;                             // of the points, 0 to 10
    uint16_t record_bytes = 0;                      // of a point, extra bytes included
    uint64_t points_offset = 0;                     // in the file
    uint64_t count = 0;                             // that many records are there
    std::array<double, 3> scale = {}, offset = {};  // coordinate = stored integer * scale + offset
    bool geographic = false;                        // coordinates are longitude and latitude, says a record
    std::vector<std::string> warnings;              // what is wrong in the header but does not matter; with the file's name
};

// Of what contradicts itself, that is believed which the size of the file bears out, with a warning. An error, with what to do, for compressed
// points (LAZ).
Result<LasHeader> read_las_header(const InputFile& file);

}  // namespace raypager
