// What 'raypager render' was asked to do.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cli/look_options.hpp"
#include "cli/option_parser.hpp"
#include "raypager/bake.hpp"
#include "raypager/camera_text.hpp"
#include "raypager/import.hpp"
#include "raypager/scene.hpp"
#include "raypager/session.hpp"

namespace raypager {

struct RenderSettings {
    std::vector<std::filesystem::path> inputs;
    std::filesystem::path output;
    RenderOptions options;  // as given; what depends on the scene (camera) is filled in by effective_options
    std::optional<CameraText> camera;
    BakeOptions bake;        // of what is not baked
    BareLook look;           // of bare inputs
    LookTexts texts;         // what was said of it
    bool denoise = false;    // pictures, before they are exposed
    std::string denoiser;    // by what; empty: not looked for yet
    double exposure = 0;     // the picture is multiplied by 2 to the power of this
    uint32_t turntable = 0;  // pictures all around; 0: one, and none of that
    std::optional<std::filesystem::path> cache_directory, reference, log, report;
    bool paper_preset = false;
    bool trace_paths_given = false;
    double snapshot_seconds = 0;  // 0: no snapshots
    bool progress = false;        // even without a terminal
    bool view = false;            // in a page
};

// Nothing if only the help was asked for. All errors are usage errors that name the option.
Result<std::optional<RenderSettings>> parse_render_settings(const Arguments& arguments);

// Options that render shares with measurements. What the picture shows and how good it gets; where it is made; what the engine otherwise
// decides by itself.
void add_picture_options(OptionParser& parser, RenderSettings& settings);
void add_device_options(OptionParser& parser, RenderSettings& settings);
// Those that decide how it pages, and how the picture is shown, which a view has, too.
void add_paging_options(OptionParser& parser, RenderSettings& settings);
void add_exposure_options(OptionParser& parser, RenderSettings& settings);
// What the film keeps beside the picture.
void add_layer_options(OptionParser& parser, RenderSettings& settings);
// Where block files are kept, and what becomes of points.
void add_baking_options(OptionParser& parser, RenderSettings& settings);
// Rules between options of a block file and of baking, which are for every verb that shows one.
Status check_inputs(const OptionParser& parser, const RenderSettings& settings);
// No file may be written twice, nor over something that is read.
Status check_distinct_files(const OptionParser& parser, const RenderSettings& settings);
void add_tuning_options(OptionParser& parser, RenderSettings& settings);

// settings.options with size, samples and camera (choose_camera) filled in from the scene where they were not given, and the layers that denoising
// needs.
Result<RenderOptions> effective_options(const RenderSettings& settings, const Blocks& scene);

}  // namespace raypager
