// What 'raypager render' was asked to do.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "blocks/bake.hpp"
#include "cli/option_parser.hpp"
#include "cli/values.hpp"
#include "raypager/scene.hpp"
#include "render/render.hpp"

namespace raypager {

struct RenderSettings {
    std::vector<std::filesystem::path> inputs;
    std::filesystem::path output;
    RenderOptions options;  // as given; what depends on the scene (camera) is filled in by effective_options
    std::optional<CameraText> camera;
    BakeOptions bake;  // of what is not baked
    std::optional<std::filesystem::path> cache_directory, reference, log, report;
    double snapshot_seconds = 0;  // 0: no snapshots
    bool progress = false;        // even without a terminal
};

// Nothing if only the help was asked for. All errors are usage errors that name the option.
Result<std::optional<RenderSettings>> parse_render_settings(const Arguments& arguments);

// settings.options with size, samples and camera (choose_camera) filled in from the scene where they were not given.
Result<RenderOptions> effective_options(const RenderSettings& settings, const BakedScene& scene);

}  // namespace raypager
