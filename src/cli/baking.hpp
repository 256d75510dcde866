// Scene files -> block file, as bake and render both do it: with warnings, notes and progress for the person at the terminal.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "raypager/bake.hpp"
#include "raypager/import.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Reads the scene and prints its warnings, at most 20 of them. host_limit: what the bake that may follow has; 0: as much as it likes.
// columns: of text clouds; empty: the files tell.
Result<Scene> import_with_warnings(const std::vector<std::filesystem::path>& inputs, uint64_t host_limit, const BareLook& look,
                                   const PointColumns& columns);
// Triangles of the ground that bare meshes and clouds are given to stand on.
uint64_t ground_triangles(const Scene& scene);
void print_warnings(const std::vector<std::string>& warnings);

// Bakes, shows progress if asked to, and says in one line what was made. A failed bake leaves output as it was.
Result<BakeSummary> bake_with_notes(const Scene& scene, BakeOptions options, const std::filesystem::path& output, bool show_progress);

}  // namespace raypager
