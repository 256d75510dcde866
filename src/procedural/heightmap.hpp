// Elevation images as height fields.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "procedural/height_field.hpp"

namespace raypager {

// Metres, rows from north to south. No voids.
struct Heightmap {
    uint32_t width = 0, height = 0;
    double spacing = 30;  // metres between pixels
    std::vector<float> values;
};

// The first channel of an elevation image as stored (not scaled). Pixels that are not finite or below -12000 m (SRTM marks voids with
// -32768) are filled from their neighbours. An image does not say how far its pixels are apart in a way that all writers agree on, so
// the size decides: tiles of 1201 pixels are SRTM's 3 arc seconds (90 m), all others count as 1 arc second (30 m).
Result<Heightmap> read_heightmap(const std::filesystem::path& path);

// A quad between each four pixels; or, if triangles is not 0, about so many triangles, heights interpolated bilinearly. Refers to map.
HeightField field_of(const Heightmap& map, uint64_t triangles);

}  // namespace raypager
