// Writes a block of instances as the bytes of abi/block.h.
#pragma once

#include "pack/pack.hpp"

namespace raypager {

// As pack(), of a world of instances. REQUIRES: one block entry.
bool pack_instances(const World& world, const Bvh& bvh, uint64_t limit, PackedBlock& block);

}  // namespace raypager
