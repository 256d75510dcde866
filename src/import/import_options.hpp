// What decides how files become a scene.
#pragma once

#include <cstdint>

#include "import/bare_look.hpp"
#include "import/point_columns.hpp"

namespace raypager {

inline constexpr uint64_t default_keep_bytes = uint64_t{512} << 20;

struct ImportOptions {
    uint64_t keep_bytes = default_keep_bytes;  // that may stay in memory of meshes that had to be read to frame them, to save reading them again
    BareLook look;                             // of bare meshes and clouds
    PointColumns columns;                      // of text clouds; empty: the files tell
};

}  // namespace raypager
