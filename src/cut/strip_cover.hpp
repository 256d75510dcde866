// Which triangles share a leaf: covers a small set of triangles with strips of up to four.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "block/strip.hpp"
#include "raypager/abi/block.h"
#include "scene/box4.hpp"

namespace raypager {

// At most this many triangles are covered at a time.
inline constexpr size_t most_covered = 64;

// Every triangle (vertex numbers in their true orientation, and its box) is in exactly one of the strips. Strip::order holds indices
// into triangles. Few strips of small boxes are sought: long ones save bytes, compact ones save time.
std::vector<Strip> cover_with_strips(std::span<const Triangle> triangles, std::span<const Box4> boxes);

}  // namespace raypager
