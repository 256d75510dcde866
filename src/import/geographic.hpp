// Clouds whose coordinates are degrees.
#pragma once

#include <span>
#include <string>

#include "import/point_readers.hpp"

namespace raypager {

// Why the points seem to have longitude and latitude in degrees but heights in metres, as an end of a sentence; empty if they do not seem to.
// said: the file calls them so. Otherwise they do if they lie within the ranges of degrees, mostly not at whole numbers, and are 200 times as high
// as they are wide: a degree is 111 km, so that even flat land gets steeper than that, while few things of such a shape stand upright in metres.
std::string seems_geographic(std::span<const FilePoint> sample, bool said);

}  // namespace raypager
