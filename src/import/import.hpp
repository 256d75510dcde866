// Files -> scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "import/bare_look.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// One .pbrt file, or any number of bare meshes (.ply .obj .stl .off) and point clouds (.las .ply .xyz .pts .txt), which are framed, lit and
// given a ground together, as `look` says. keep_bytes: what may stay in memory of meshes that had to be read for that, to save reading them again.
inline constexpr uint64_t default_keep_bytes = uint64_t{512} << 20;
Result<Scene> import_scene(const std::vector<std::filesystem::path>& inputs, uint64_t keep_bytes = default_keep_bytes, const BareLook& look = {});

}  // namespace raypager
