// Surfaces that shine by an image. Lights are uniform here, so triangles that shine about alike become one light, of their mean colour.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "import/gltf_mesh.hpp"
#include "import/gltf_textures.hpp"

namespace raypager {

struct GltfGlow {
    std::shared_ptr<const std::vector<uint8_t>> groups;  // by triangle, as GltfReading has them; 0: it is dark
    std::vector<Float3> means;                           // of the image, by group; of group 0 black
};

Result<GltfGlow> group_by_glow(const GltfModel& model, const GltfReading& reading, const GltfSmallImage& image);

}  // namespace raypager
