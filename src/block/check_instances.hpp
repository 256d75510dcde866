// Whether the instances of a block hold together.
#pragma once

#include <cstddef>
#include <span>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// The part of check_block_bytes that comes behind the header and where its sections lie. entry: the first of the block. REQUIRES: there is one.
Status check_instances(const BakedScene& scene, const rp_block_header& header, const rp_block_entry& entry, std::span<const std::byte> bytes);

}  // namespace raypager
