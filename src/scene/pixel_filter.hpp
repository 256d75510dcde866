// What a pixel filter is as numbers.
#pragma once

#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

Status check_filter(const PixelFilter& filter);  // finite, with radii of more than 0, and positive somewhere

// The function of x (axis 0) or y (axis 1) whose products are the filter; never negative, and 0 beyond the radius.
double filter_weight(const PixelFilter& filter, uint32_t axis, double distance);

// Whether the filter has places where it would be negative.
bool has_negative_lobes(const PixelFilter& filter);

// How much of that function lies within k / steps of the radius around the middle, for k from 0 to steps, as a share of the whole: from 0 to 1, never
// falling.
std::vector<float> filter_shares(const PixelFilter& filter, uint32_t axis, uint32_t steps);

}  // namespace raypager
