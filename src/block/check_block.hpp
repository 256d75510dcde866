// Whether the bytes of a block hold together, so that no kernel can read outside of them, even where all checksums are right.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Sections, tree, leaves, vertex indices, ids, and what the scene says about the block. The message names no file.
Status check_block_bytes(const BakedScene& scene, uint32_t block, std::span<const std::byte> bytes);

}  // namespace raypager
