// What images of lights show, in double precision. Shares the layout of texels with the renderer, and nothing else.
#pragma once

#include "raypager/scene.hpp"
#include "reference/vector.hpp"

namespace raypager::reference {

// Radiance, or the factor of intensity, in a unit direction of the image's space.
Vec3 color_in_direction(const LightImage& image, const Vec3& direction);
// At x from left to right and y from top to bottom, both in [0, 1]; black beyond.
Vec3 color_at(const LightImage& image, double x, double y);
// Of a light at a point, towards a unit direction. images: of the scene.
Vec3 lamp_intensity(const rp_light& light, const LightImages& images, const Vec3& direction);

}  // namespace raypager::reference
