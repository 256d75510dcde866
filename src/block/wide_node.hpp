// Boxes of a wide node's children in eight bits an axis, rounded outwards.
#pragma once

#include <span>

#include "raypager/abi/wide.h"
#include "scene/box.hpp"

namespace raypager {

// Sets origin, exponents, bounds and count of the node, such that every box, made larger by its slack (abi/wide.h), is inside its stored one.
// REQUIRES: 1 to 8 boxes, none empty, finite.
void quantise(std::span<const Box> boxes, rp_wide_node& node);
// The box, made larger by its slack and rounded outwards: inside the stored box of every node that has it for a child.
Box with_slack(const Box& box);
// The stored box of a child, as kernels see it.
Box stored_box(const rp_wide_node& node, uint32_t child);

}  // namespace raypager
