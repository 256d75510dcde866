// Files -> scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "import/point_columns.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// One .pbrt file, or any number of bare meshes (.ply .obj .stl .off) and point clouds (.las .ply .xyz .pts .txt), which are framed, lit and
// given a ground together. keep_bytes: what may stay in memory of meshes that had to be read for that, to save reading them again.
// columns: of text clouds, what they are; empty: the files tell.
inline constexpr uint64_t default_keep_bytes = uint64_t{512} << 20;
Result<Scene> import_scene(const std::vector<std::filesystem::path>& inputs, uint64_t keep_bytes = default_keep_bytes,
                           const PointColumns& columns = {});

}  // namespace raypager
