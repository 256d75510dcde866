// How far two pictures are apart.
#pragma once

#include "image/image.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct ImageDifference {
    double rmse = 0;          // root of the mean over pixels and channels of (a - b)^2
    double relative_mse = 0;  // mean of (a - b)^2 / (b^2 + 0.01); b is the reference
    double max_difference = 0;
};

// Usage error if the sizes differ.
Result<ImageDifference> compare_images(const Image& a, const Image& b);

}  // namespace raypager
