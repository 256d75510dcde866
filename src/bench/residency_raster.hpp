// Which blocks were resident when, as a picture: time to the right, blocks downwards in the order of the block file, which lays neighbours
// in space next to each other. Thousands of blocks share rows, thousands of rounds share columns; the shade is the share that was resident.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "residency/block_table.hpp"

namespace raypager::bench {

struct ResidencyRaster {
    static constexpr uint8_t full = 8;  // shade of a cell all of whose blocks were resident
    uint32_t columns = 0, rows = 0;
    double seconds = 0;           // that the columns span
    uint32_t blocks = 0;          // that the rows span
    std::vector<uint8_t> shades;  // row by row, 0 .. full
};

// journal and round_seconds as in RenderResult. Each column shows the middle of its time.
ResidencyRaster rasterise_residency(const std::vector<PagingEvent>& journal, const std::vector<float>& round_seconds, uint32_t block_count,
                                    uint32_t most_columns = 320, uint32_t most_rows = 128);
// An <svg> element; runs of one shade are one rectangle.
std::string svg_residency(const ResidencyRaster& raster);

}  // namespace raypager::bench
