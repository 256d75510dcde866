// What a block file says must make sense before anything relies on it, even where all checksums are right.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "block/baked_scene.hpp"
#include "raypager/abi/wide.h"
#include "raypager/status.hpp"

namespace raypager {

// Everything but the blocks and pages: indices, images and programs, bounds, the top tree, the paths of the block entries, where the blocks lie.
Status check_scene(const BakedScene& scene, uint64_t file_bytes);

}  // namespace raypager
