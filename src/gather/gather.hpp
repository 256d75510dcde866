// Loads a scene's shapes and places them in the world.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>

#include "clouds/point_cloud.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "world/bake_memory.hpp"
#include "world/records.hpp"
#include "world/world.hpp"

namespace raypager {

struct Gathered {
    World world;                    // with all primitives, or, if there are too many for memory, with the bounds only:
    std::optional<Bucket> spilled;  // then they are here
    Box bounds;                     // of all shapes that are no backdrop; of all, if there is nothing else
    uint64_t triangles = 0, spheres = 0;
    uint64_t weight = 0;  // spilled: estimated bytes of all primitives in blocks
    std::vector<rp_primitive_range> ranges;
    std::vector<rp_light> lights;  // emissive primitives, then the scene's own lights; probabilities filled in
    MeshIssues issues;
    uint64_t points_culled = 0, points_merged = 0;
};

struct GatherLimits {
    BakeMemory memory;                        // by default all that there is
    std::filesystem::path spill_beside;       // scratch files come beside this file
    const std::atomic<bool>* stop = nullptr;  // ends with an error soon after it becomes true
};

// stage: "load" while all is in memory, "stream" from when it is not.
using GatherProgress = std::function<void(const char* stage, double fraction)>;

// Primitives are numbered in the order of scene.shapes. Positions are transformed in double precision and rounded once; those of meshes to multiples
// of position_cell, if it is not 0. Primitives that no ray can hit once their vertices are rounded (no area, radius 0) are dropped and counted. An
// error names the shape: its mesh cannot be loaded, a coordinate is beyond +-1e12, or there are 2^32 - 1 primitives or vertices or more.
Result<Gathered> gather(const Scene& scene, const GatherLimits& limits, const GatherProgress& progress, const PointOptions& points = {},
                        float position_cell = 0);
// All in memory.
Result<Gathered> gather(const Scene& scene, const std::function<void(double fraction)>& progress, const PointOptions& points = {});

}  // namespace raypager
