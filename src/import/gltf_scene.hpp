// glTF 2.0 scenes.
#pragma once

#include <filesystem>

#include "raypager/import.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Where the file has no camera, it is framed as bare meshes are, and where it has no light, lit as they are; where it has neither, it stands on their
// ground, too. What shines brighter than white counts as a light.
Result<Scene> import_gltf(const std::filesystem::path& path, const BareLook& look);

}  // namespace raypager
