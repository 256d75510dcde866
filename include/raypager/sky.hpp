// Images that lights shine as or through, skies above all: light from all around that differs by direction. Images of all directions are square and
// in the equal-area octahedral mapping of pbrt-v4 (abi/light_image.h); what is unrolled like the map of a globe is brought into it.
#pragma once

#include <array>
#include <memory>

#include "raypager/picture.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Each pixel takes 8 bytes on the device.
inline constexpr uint32_t max_sky_size = 16384;  // pixels a side
inline constexpr uint64_t max_light_texels = uint64_t{1} << 28;

// The place of a direction (of any length but 0) on the image, in [0, 1]^2, (0, 0) top left; and back.
std::array<double, 2> sky_place(const std::array<double, 3>& direction);
std::array<double, 3> sky_direction(double u, double v);

// Where it lies on the map of a globe: rows from +z (top) to -z, columns from +x by way of +y.
std::array<double, 2> globe_place(const std::array<double, 3>& direction);
// Brings such an image into the mapping of skies, with at least as many pixels as its middle rows have for the same solid angle.
Image sky_of_globe(const Image& globe);

// The colour of a sky's image in a direction, interpolated as kernels do.
Float3 sky_color(const Image& image, const std::array<double, 3>& direction);

// Makes `image` (square, one channel or three, linear, all values finite and 0 or more) the sky of the scene, in place of an infinite light.
// axes: unit vectors at right angles to each other, the image's x, y and z axis in the world.
Status set_sky(Scene& scene, const Image& image, const std::array<Float3, 3>& axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});

// For Scene::light_images.
Result<std::shared_ptr<const LightImage>> light_image_of(const Image& image);
Float3 mean_color(const LightImage& image);
// A texel's colour; and the texel that is nearest to a colour.
Float3 texel_color(const rp_texel& texel);
rp_texel texel_of(const Float3& color);

}  // namespace raypager
