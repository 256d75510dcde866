// Scenes whose coordinates are too large for what is to be seen.
#pragma once

#include "raypager/scene.hpp"

namespace raypager {

// Rays leave a surface a little above it, by what rounding may have moved it: about a millionth of the largest coordinate of the triangle or sphere
// that they leave. Beside something that is not much larger than that, and fills a part of the picture, light leaks and shadows are lost. Adds a
// warning where that is so. Looks at shapes in memory, and at what is known of others.
void warn_of_precision(Scene& scene);

}  // namespace raypager
