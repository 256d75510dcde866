// What holds of every material that is rendered, whoever made it.
#pragma once

#include <span>

#include "raypager/abi/scene.h"
#include "raypager/status.hpp"

namespace raypager {

// Of materials[index]. A mix names materials before it, so none is part of itself.
Status check_material(std::span<const rp_material> materials, size_t index);

// Whether rays may pass it as if there were nothing: a mix with RP_NONE, or with such a mix. REQUIRES: materials that have been checked.
bool may_be_nothing(std::span<const rp_material> materials, size_t index);

// How many mixes are within each other; 0: it is none.
uint32_t mix_depth(std::span<const rp_material> materials, size_t index);

}  // namespace raypager
