// Cutting a polygon into triangles along its outline.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

// outline: counter-clockwise, in a plane, with at least three corners; parts of it may touch (as where a hole is joined to it). triangles
// (emptied first) gets numbers of its corners, as many triangles as there are corners less two at most, counter-clockwise. False if the
// outline crosses itself.
bool cut_polygon(std::span<const std::array<double, 2>> outline, std::vector<Triangle>& triangles);

}  // namespace raypager
