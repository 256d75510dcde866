// Block files of scenes that are given unbaked: baked once, kept, and found again by the fingerprint of their inputs.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "cli/view.hpp"
#include "raypager/bake.hpp"
#include "raypager/import.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct OpenedScene {
    Blocks blocks;
    double bake_seconds = 0;        // import included; 0 if the block file was given
    uint64_t ground_triangles = 0;  // that a bare input was given to stand on; 0 if the block file was given
};

struct BakeRequest {
    BakeOptions options;
    View view;  // whose size bare inputs are framed for; culling and filtering go by all of it. Otherwise blocks are the same for every view.
    bool show_progress = false;
    BareLook look = {};
};

// One .rpb is opened. Anything else is imported, and baked unless a folder holds a block file of its geometry already, which then takes on the looks
// of what was imported: neither materials nor lights nor the camera are a reason to bake again. The block file goes to
// cache_directory (made if absent) if given; otherwise beside the first input, or to the user's cache folder where that is not writable.
// There it replaces those of earlier versions of the same inputs.
Result<OpenedScene> open_scene(const std::vector<std::filesystem::path>& inputs, const std::optional<std::filesystem::path>& cache_directory,
                               const BakeRequest& request);

// Where an unbaked scene's block file may lie, the best place first.
std::vector<std::filesystem::path> cache_folders(const std::filesystem::path& input, const std::optional<std::filesystem::path>& cache_directory);

}  // namespace raypager
