// Writes procedural scenes of any size: a .pbrt file and its meshes (binary PLY) beside it, streaming, the same for the same seed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "raypager/status.hpp"

namespace raypager {

enum class PointFormat { las, ply };

struct MakeSceneOptions {
    std::string kind;                       // "cornell", "terrain", "clutter", "points", "museum" or "forest"
    std::filesystem::path directory;        // made if absent
    uint64_t triangles = 0;                 // about so many, those of what is placed often counted once; 0: the kind's default
    uint64_t points = 0;                    // of "points", which has no triangles; 0: the default
    uint64_t textures = 0;                  // of "museum", as are texture_bytes: so many images; 0: the default
    uint64_t texture_bytes = 0;             // of all of them, decoded; 0: the default
    uint64_t instances = 0;                 // of "forest": so many; 0: the default
    PointFormat format = PointFormat::las;  // of the points' file
    uint64_t seed = 1;
    std::optional<std::filesystem::path> heightmap;  // terrain only: an elevation image
    std::function<void(double share)> progress;      // museum only: how much of the images is written; called by one thread at a time
};

struct MadeScene {
    std::filesystem::path scene_file;
    uint64_t triangles = 0, points = 0, bytes = 0;
    uint64_t textures = 0, texture_bytes = 0;
    uint64_t instances = 0;
};

Result<MadeScene> make_scene(const MakeSceneOptions& options);

}  // namespace raypager
