// What a block file says must make sense before anything relies on it, even where all checksums are right.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "raypager/abi/wide.h"
#include "raypager/status.hpp"
#include "store/baked_scene.hpp"

namespace raypager {

// Everything but the blocks: indices, bounds, the top tree, the paths of the portals, where the blocks lie.
Status check_scene(const BakedScene& scene, uint64_t file_bytes);
// The bytes of one block: sections, tree, leaves, vertex indices, ids, and what the scene says about it. The message names no file.
Status check_block_bytes(const BakedScene& scene, uint32_t block, std::span<const std::byte> bytes);

}  // namespace raypager
