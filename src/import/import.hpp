// Files -> scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "import/import_options.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// One .pbrt file, or any number of bare meshes (.ply .obj .stl .off) and point clouds (.las .ply .xyz .pts .txt), which are framed, lit and
// given a ground together.
Result<Scene> import_scene(const std::vector<std::filesystem::path>& inputs, const ImportOptions& options = {});

}  // namespace raypager
