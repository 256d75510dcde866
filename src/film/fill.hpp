// Pixels that no sample has reached yet, in a picture that is looked at before its time.
#pragma once

#include <vector>

#include "raypager/picture.hpp"

namespace raypager {

// Gives them the colours around them: the nearest ones where there are any, averages of ever larger squares where there are not. The picture stays as
// it is if none of its pixels is sampled. unsampled: by pixel, rows from top to bottom.
void fill_unsampled(Image& image, const std::vector<bool>& unsampled);

}  // namespace raypager
