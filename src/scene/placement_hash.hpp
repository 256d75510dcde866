// What tells whether placements are still the same.
#pragma once

#include <span>

#include "base/hash.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Field by field: what lies between them is not set. How placements are cut into spans makes no difference.
void add_placements(std::span<const Placement> placements, Hash64Stream& hash);

}  // namespace raypager
