// Writes procedural scenes of any size: a .pbrt file and its meshes (binary PLY) beside it, streaming, the same for the same seed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "raypager/status.hpp"

namespace raypager {

enum class PointFormat { las, ply };

struct MakeSceneOptions {
    std::string kind;                       // "cornell", "terrain", "clutter", "points", "museum", "forest" or "island"
    std::filesystem::path directory;        // made if absent
    uint64_t triangles = 0;                 // about so many, those of what is placed often counted once; 0: the kind's default
    uint64_t points = 0;                    // of "points", which has no triangles; 0: the default
    uint64_t textures = 0;                  // of "museum", as are texture_bytes: so many images; 0: the default
    uint64_t texture_bytes = 0;             // of all of them, decoded; 0: the default
    uint64_t instances = 0;                 // of "forest" and "island": so many; 0: the default
    uint64_t copies = 0;                    // of "island": the whole of it, with its instances, placed so often; 0: once
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

// Sets the triangles and instances of a scene of a name, where they are 0: "moana" has those of the island in the film of that name, which
// Walt Disney Animation Studios published, 261 million quads (two triangles each) in 39.3 million instances.
Status apply_preset(std::string_view preset, MakeSceneOptions& options);

Result<MadeScene> make_scene(const MakeSceneOptions& options);

}  // namespace raypager
