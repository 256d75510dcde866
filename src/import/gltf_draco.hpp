// Meshes of glTF that Draco has compressed (KHR_draco_mesh_compression).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// What is wanted of an attribute of the mesh.
struct DracoAttribute {
    int64_t id = -1;         // in the compressed mesh; -1: nothing
    bool fractions = false;  // integers stand for 0, or -1, to 1
    uint32_t components = 3;
    std::vector<float> values = {};  // what it has: so many for each vertex
};

// Fills values of the attributes. An error says what is wrong, without a place.
Status unpack_draco(std::span<const std::byte> packed, std::span<DracoAttribute* const> attributes, std::vector<uint32_t>& indices);

}  // namespace raypager
