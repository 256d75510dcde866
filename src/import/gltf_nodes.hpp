// The nodes of a glTF scene, and where they are in the world.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "import/gltf_model.hpp"
#include "import/gltf_notes.hpp"
#include "raypager/scene.hpp"

namespace raypager {

struct GltfNode {
    int64_t number = 0;
    Transform to_world;
};

// All nodes of the default scene, or of the first, parents before their children. An error if one is its own ancestor, or has two parents.
Result<std::vector<GltfNode>> walk_gltf_nodes(const GltfModel& model, GltfNotes& notes);

// Hands on where a node puts its mesh (EXT_mesh_gpu_instancing), in its own space; one identity if it has no instances. A status that take returns
// ends the call and is passed on.
Status for_each_gltf_instance(const GltfModel& model, const tinygltf::Node& node, const std::function<Status(const Transform&)>& take);

// From the space of a mesh into the world, by joint (GltfReading::joints).
Result<std::vector<Transform>> gltf_joints_of(const GltfModel& model, int64_t skin, const std::vector<GltfNode>& nodes);

}  // namespace raypager
