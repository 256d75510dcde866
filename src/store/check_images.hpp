// Images, their levels and pages, and the programs that read them, as a block file has them: kernels must find all texels in pages.
#pragma once

#include <cstdint>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Of the programs alone: what check_textures asks of programs on these images.
Status check_programs(const BakedScene& scene);

Status check_images(const BakedScene& scene, uint64_t file_bytes);

}  // namespace raypager
