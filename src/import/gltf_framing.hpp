// A camera and light for glTF scenes that have none, as bare meshes get them.
#pragma once

#include <memory>
#include <vector>

#include "import/gltf_model.hpp"
#include "raypager/import.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Where some shapes stand in the world.
struct GltfPlaced {
    std::vector<std::shared_ptr<const MeshSource>> meshes;
    std::vector<Transform> places;
};

// Clouds of the scene itself are framed, too. The first material is that of a ground.
Status frame_gltf(const GltfModel& model, const BareLook& look, bool has_camera, bool has_light, const std::vector<GltfPlaced>& placed, Scene& scene);

}  // namespace raypager
