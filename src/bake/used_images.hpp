// Of a scene's images those are baked that some program reads, and they are numbered anew.
#pragma once

#include <cstdint>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

// Their numbers in Scene::images, rising. REQUIRES: a scene that validate() accepts, here and below.
std::vector<uint32_t> used_images(const Scene& scene);

// The operations with the new numbers.
std::vector<rp_texture_op> baked_texture_ops(const Scene& scene);

}  // namespace raypager
