// Rays to measure traversal with: what a path tracer's first two segments and first connection look like.
#pragma once

#include <cstdint>
#include <vector>

#include "raypager/scene.hpp"
#include "wavefront/path_state.hpp"

namespace raypager::bench {

using Ray = SlotRay;

// Where a ray ended.
struct SurfacePoint {
    bool hit = false;
    Float3 position, normal;  // unit, to either side
    uint32_t primitive = 0;
    float t = 0;
};

// One ray through the middle of each pixel, in tiles of 8 x 8 pixels as far as they are whole.
std::vector<Ray> primary_rays(const Camera& camera, uint32_t width, uint32_t height);
// Lets every ray without a hit end at a random point of the box, as if it had come up to a ceiling there: the published figures that ours stand
// beside fill their sets of bounces and shadow rays in this way.
void end_at_ceiling(std::vector<Ray>& rays, std::vector<SurfacePoint>& hits, const Float3& corner_low, const Float3& corner_high, uint32_t seed);
// One cosine-distributed direction from every hit, in the order of the rays; misses leave none.
std::vector<Ray> diffuse_rays(const std::vector<Ray>& rays, const std::vector<SurfacePoint>& hits, uint32_t seed);
// From every hit to a random point between corner_low and corner_high; misses leave none.
std::vector<Ray> shadow_rays(const std::vector<Ray>& rays, const std::vector<SurfacePoint>& hits, const Float3& corner_low, const Float3& corner_high,
                             uint32_t seed);

}  // namespace raypager::bench
