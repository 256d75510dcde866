// What becomes of a block file in which fields were changed, past the checks of BlockFile::open.
#pragma once

#include <cstdint>

#include "store/block_file.hpp"

namespace raypager::support {

// Whether all blocks and pages pass all checks. Those that do are decoded, and brought into the form of a CPU's memory.
bool verify_all(const BlockFile& file);

// Renders a few pixels with little memory; choice: by which way of tracing, and whether there is room for the largest block alone.
Status render_edited(const BlockFile& file, uint64_t choice);

}  // namespace raypager::support
