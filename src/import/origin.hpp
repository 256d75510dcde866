// Surveyed coordinates lie far from their origin, too far for single precision: they are shown relative to a place among them.
#pragma once

#include <array>
#include <vector>

namespace raypager {

inline constexpr double largest_file_coordinate = 1e18;  // its square is a float with room to spare

using FilePosition = std::array<double, 3>;

// None of the coordinates is infinite, too large or not a number.
bool is_usable(const FilePosition& position);

// Whole thousands near the middle of the positions: a few strays far away, or at zero, do not move it. Zero along each axis along which that is
// near enough to zero, or would not bring the positions much nearer.
FilePosition choose_origin(const std::vector<FilePosition>& sample);

// The distance of the middle from zero, in extents of the positions.
double remoteness(const std::vector<FilePosition>& sample);

}  // namespace raypager
