// The vertices of a primitive of a glTF file, out of accessors or out of Draco, moved by morph targets and by a skin.
#pragma once

#include <cstdint>
#include <vector>

#include "import/gltf_mesh.hpp"
#include "raypager/scene.hpp"

namespace raypager {

struct GltfArrays {
    std::vector<Float3> positions, normals;  // as many normals as positions, or none
    std::vector<Float2> uvs;                 // likewise
    std::vector<Float3> colors;              // likewise; linear
    std::vector<uint32_t> corners;           // indices of what the mode of the primitive makes of them
};

// What a mode of triangles makes of corners.
std::vector<Triangle> gltf_triangles(const std::vector<uint32_t>& corners, int mode);

// An error is without the name of the primitive.
Status read_gltf_arrays(const GltfModel& model, const GltfReading& reading, GltfArrays& arrays);

}  // namespace raypager
