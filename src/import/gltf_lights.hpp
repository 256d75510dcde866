// Lights (KHR_lights_punctual) and cameras of a glTF file.
#pragma once

#include <optional>

#include "import/gltf_nodes.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// The light of a node, if it has one.
//
// Radiance is luminance: a candela is 1, and so are a lux and a nit, as in the viewers of Khronos, three.js and others, so that lights and surfaces
// that shine (KHR_materials_emissive_strength, in nits) are to each other as there. But for files that Blender wrote: it multiplies the watts of its
// lights by 683 lumens, and nothing else, so these are divided by as much again.
Status add_gltf_light(const GltfModel& model, const GltfNode& node, Scene& scene, GltfNotes& notes);

// Makes the first camera of the nodes that of the scene, with a picture of its shape. False: there is none.
Result<bool> take_gltf_camera(const GltfModel& model, const std::vector<GltfNode>& nodes, Scene& scene, GltfNotes& notes);

}  // namespace raypager
