// What must hold of the images of lights.
#pragma once

#include <span>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// The number of a light's image, or nothing.
std::optional<uint32_t> image_of(const rp_light& light);

// The number of the image that the sky has, or nothing.
std::optional<uint32_t> sky_image(std::span<const rp_light> lights);

// Images have a size and finite texels, there are as many as lights refer to, and those that lights shine as or through are fit for it. sky_in_pages:
// that of the sky has a size alone.
Status check_light_images(const LightImages& images, std::span<const rp_light> lights, bool sky_in_pages = false);

}  // namespace raypager
