// A baked scene takes on the looks of a scene that has the same geometry and images: materials and their programs, lights, camera and settings of the
// picture. So none of these is a reason to bake again.
#pragma once

#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "store/block_file.hpp"

namespace raypager {

// Copies all that neither geometry nor the list of lights decides: camera, film, size, samples, depth, materials, their
// programs and the images of lights.
void take_settings(const Scene& scene, BakedScene& baked);

// Afterwards `baked` is what baking `scene` anew would have made of it, to the bit.
// REQUIRES: both have the same bake_fingerprint.
// False where that cannot be done: beyond 2^24 - 2 area lights a range does not know its own. An error if a mesh that shines unseen cannot be read,
// or programs place texels where the images have none. Either way nothing has changed then.
Result<bool> restyle(const Scene& scene, BakedScene& baked);

}  // namespace raypager
