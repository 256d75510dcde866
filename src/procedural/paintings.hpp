// Pictures for the walls of a museum: landscapes, portraits, fields of colour, grids, circles and clouds of paint.
#pragma once

#include <memory>

#include "procedural/image_painter.hpp"

namespace raypager {

// aspect: how wide it hangs over how high, whatever its texels. The seed decides everything else.
std::unique_ptr<ImagePainter> make_painting(uint32_t width, uint32_t height, double aspect, uint64_t seed);

}  // namespace raypager
