// The rays of a scene's camera through a pixel of its picture, in double precision.
#pragma once

#include "reference/bsdf.hpp"
#include "reference/vector.hpp"

namespace raypager::reference {

struct CameraRay {
    Vec3 origin, direction;  // the latter unit
};

// Through the place (u, v) of the picture, (0, 0) top left and (1, 1) bottom right. on_lens: a point of the unit disk.
CameraRay camera_ray(const Camera& camera, double u, double v, double lens_x = 0, double lens_y = 0);

// Where a sample of a pixel falls, in pixels from the pixel's top left corner: as often as the filter counts there.
struct PixelPlace {
    double x, y;
};
PixelPlace place_in_pixel(const PixelFilter& filter, Random& random);

// A sample of a pixel.
CameraRay camera_ray(const Scene& scene, uint32_t column, uint32_t row, uint32_t width, uint32_t height, Random& random);

}  // namespace raypager::reference
