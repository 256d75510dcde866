// A baked scene -> a scene of Mitsuba 3, so that both can render the same: scene.xml, and binary PLY meshes beside it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "raypager/status.hpp"
#include "store/block_file.hpp"

namespace raypager::bench {

struct ExportSummary {
    uint64_t triangles = 0, spheres = 0;
    uint64_t bytes = 0;  // of all files
};

// Light transport is the same: path tracing with next-event estimation, as many scattering events, Russian roulette from the second on, a box
// filter, RGB. What differs: Mitsuba's rough conductors shadow and mask separately, ours height-correlated. Triangles become one mesh for
// each material, without shared vertices. Memory is bounded. progress: fraction done.
// An error for what Mitsuba has not: triangles that shine to both sides, lights that shine unseen.
Result<ExportSummary> export_to_mitsuba(const BlockFile& file, const std::filesystem::path& directory,
                                        const std::function<void(double)>& progress = {});

}  // namespace raypager::bench
