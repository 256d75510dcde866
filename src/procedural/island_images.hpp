// Images of an island: its ground and the water around it as they are seen from above, what cuts fronds and flowers out of cards, and the sky.
#pragma once

#include <memory>

#include "procedural/image_painter.hpp"
#include "procedural/island_land.hpp"
#include "raypager/picture.hpp"

namespace raypager {

// Both along the land's axes: u along x, v along z. The land must outlive the painter.
std::unique_ptr<ImagePainter> paint_ground(const IslandLand& land, uint32_t size, uint64_t seed);
std::unique_ptr<ImagePainter> paint_water(const IslandLand& land, uint32_t size, uint64_t seed);
// Linear reflectance at the edge of the painted water, for that further out.
constexpr std::array<double, 3> open_water = {0.006, 0.036, 0.072};

std::unique_ptr<ImagePainter> paint_frond_mask(uint32_t width, uint32_t height);
std::unique_ptr<ImagePainter> paint_flower_mask(uint32_t size);

// Radiance from all directions in the equal-area mapping of pbrt-v4, z up, linear. to_sun: a unit vector of a world with y up.
Image paint_sky(uint32_t size, const Vector& to_sun, uint64_t seed);

}  // namespace raypager
