// From the stored form of a block to the form in the memory of a device.
#pragma once

#include <cstddef>
#include <span>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Turns the stored bytes at the start of `bytes` into the form that is asked for, in the same place, in linear time.
// REQUIRES: bytes that check_block accepts, aligned to 4, and room for either form.
Status transcode_block(const BakedScene& scene, uint32_t block, BlockForm form, std::span<std::byte> bytes);

}  // namespace raypager
