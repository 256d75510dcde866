// Cameras beyond the pinhole.
#pragma once

#include <array>

#include "raypager/scene.hpp"
#include "scene/vector.hpp"

namespace raypager {

// The projection is known, and lens and window make sense.
Status check_projection(const Camera& camera);

// Whether a camera is an upright pinhole, or lens, whose line of sight goes through the middle of its picture: what other renderers can describe.
bool is_centered_perspective(const Camera& camera);

struct ViewRay {
    Vector origin, direction;  // the latter unit
};
// The ray through the place (u, v) of a picture, (0, 0) top left and (1, 1) bottom right, and the middle of the lens.
ViewRay view_ray(const Camera& camera, double u, double v);

}  // namespace raypager
