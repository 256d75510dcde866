#include "cli/render_settings.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "cli/look_options.hpp"
#include "cli/output_paths.hpp"
#include "cli/point_options.hpp"
#include "cli/tune_option.hpp"
#include "cli/values.hpp"
#include "cli/view.hpp"
#include "raypager/abi/types.h"
#include "raypager/baselines.hpp"

namespace raypager {
namespace {

constexpr uint64_t max_samples = 65535;  // what the film's fixed point holds without overflow (abi/film.h)
constexpr uint64_t max_paths = uint64_t{1} << 30;
constexpr uint64_t max_loads = 1024;
constexpr uint64_t deepest = 60000;  // path state counts scattering events in 16 bits

constexpr const char* about_render =
    "Renders a picture. INPUT is a block file (.rpb), a .pbrt, .gltf or .glb scene, or any number of meshes (.ply .obj .stl .off) and point\n"
    "clouds (.las .ply .xyz .pts .txt .asc .csv), also packed (.gz), which are framed, lit and given a ground. What is not baked is baked first; the "
    "block file is kept beside "
    "the input and used again.";

constexpr double max_stops = 64;
constexpr uint64_t max_turns = 9999;

Result<Background> parse_background(const std::string& text) {
    if (text == "transparent") return Background{true, {}};
    const auto color = parse_color(text);
    if (!color) return Status::usage(color.status().message() + "; or transparent");
    return Background{false, *color};
}

Result<PoolPlace> parse_pool(const std::string& text) {
    if (text == "device") return PoolPlace::device;
    if (text == "host") return PoolPlace::host;
    return Status::usage(fmt::format("'{}' is not a place for the pool; use device or host", text));
}

OptionParser::Setter into_optional_path(std::optional<std::filesystem::path>& target) {
    return [&target](const std::string& text) {
        target.emplace();
        return into_path(*target)(text);
    };
}

// Options for measurements: what the engine decides by itself, and baselines. None of them changes the picture, but the preset's roulette
// changes its noise.
void add_measurement_options(OptionParser& parser, RenderSettings& settings) {
    RenderOptions& options = settings.options;
    parser.option("preset", "NAME",
                  "paper: the settings of the paper (4 paths per pixel, roulette connection, one swap per round that is waited for, most wanted "
                  "in, least bounced out); options behind this one override it",
                  [&settings](const std::string& text) -> Status {
                      if (text != "paper") return Status::usage(fmt::format("'{}' is not a preset; there is one, paper", text));
                      const uint32_t paths = settings.options.tuning.paths;
                      use_paper_settings(settings.options, 0, 0);
                      settings.options.tuning.paths = paths;  // the default follows from the size of the picture
                      settings.paper_preset = true;
                      return {};
                  });
    parser.option("pool", "PLACE",
                  "device, or as a baseline host: all geometry in mapped host memory, read across the bus without paging "
                  "(default: device)",
                  into(options.tuning.pool_place, parse_pool));
    parser.option("record-trace", "FILE", "record which blocks paths enter, for 'raypager bench policy'", into_path(options.record.file));
    parser.option("trace-paths", "N", "about how many of all paths to record, spread evenly (default: 500K)",
                  [&settings](const std::string& text) -> Status {
                      const auto count = parse_count(text, 1, max_paths);
                      if (!count) return count.status();
                      settings.options.record.paths = *count;
                      settings.trace_paths_given = true;
                      return {};
                  });
}

// What becomes of a picture beside its light: these are for scenes and block files, too.
void add_developing_options(OptionParser& parser, RenderSettings& settings) {
    add_exposure_options(parser, settings);
    parser.option(
        "adaptive", "ERROR",
        "adaptive sampling: a pixel stops, with --spp samples at most, when its error is below this share of the picture's mean brightness; the "
        "fewer samples it has, the further below; 0.0001 to 10 (default: all pixels get --spp samples)",
        into(settings.options.adaptive_error, [](const std::string& text) -> Result<double> {
            const auto error = parse_finite(text);
            if (!error || !(*error >= 0.0001 && *error <= 10)) return Status::usage(fmt::format("'{}' is not a number from 0.0001 to 10", text));
            return *error;
        }));
    add_layer_options(parser, settings);
    parser.option("turntable", "N",
                  "N pictures, NAME_000.png and so on, for which the camera goes once around what the scene shows, about the axis that is upright "
                  "in the picture (default: one picture, as named)",
                  into_count(settings.turntable, 1, max_turns));
}

void add_output_options(OptionParser& parser, RenderSettings& settings) {
    parser.option("snapshots", "SECONDS", "how often to rewrite the picture while rendering (default: never)",
                  into(settings.snapshot_seconds, parse_seconds));
    parser.option("log", "FILE.csv",
                  "convergence log: seconds, spp, rmse, loads, bytes loaded, rays; a row for each snapshot, or every second "
                  "without --snapshots",
                  into_optional_path(settings.log));
    parser.option("reference", "FILE", "picture of the same size to compare with: fills the log's rmse", into_optional_path(settings.reference));
    parser.option("report", "FILE.json", "what was done, with every figure, for scripts", into_optional_path(settings.report));
    add_baking_options(parser, settings);
    parser.flag("progress", "show progress even if stderr is not a terminal", settings.progress);
#ifdef RAYPAGER_VIEW
    parser.flag("view", "watch it in a browser on this machine, at the address that is printed; as 'raypager view', but the camera stays",
                settings.view);
#endif
}

void add_checkpoint_options(OptionParser& parser, RenderSettings& settings) {
    CheckpointOptions& checkpoint = settings.options.checkpoint;
    parser.option("checkpoint", "FILE",
                  "keep all work in this file: at intervals, when the render is stopped, and at its end; it must not exist "
                  "yet, except with --resume",
                  into_path(checkpoint.file));
    parser.option("checkpoint-every", "SECONDS", "how often to write the checkpoint (default: 60)", into(checkpoint.every_seconds, parse_seconds));
    parser.flag(
        "resume",
        "go on from the checkpoint, or start from the beginning if there is none yet; scene and picture options must be the same, but --spp may be "
        "larger; limits, policy and paths may differ",
        checkpoint.resume);
}

Status check_picture_options(const OptionParser& parser, const RenderSettings& settings) {
    if (settings.options.background && settings.options.background->transparent && !holds_alpha(settings.output))
        return parser.wrong(fmt::format("--background transparent: '{}' has no place for it; write .exr or .png", settings.output.string()));
    if (settings.turntable == 0) return {};
    const std::pair<bool, const char*> single[] = {{settings.view, "--view"},
                                                   {!settings.options.checkpoint.file.empty(), "--checkpoint"},
                                                   {settings.log.has_value(), "--log"},
                                                   {settings.reference.has_value(), "--reference"},
                                                   {!settings.options.record.file.empty(), "--record-trace"},
                                                   {settings.bake.points.cull_to_camera, "--cull-to-camera"}};
    for (const auto& [given, name] : single)
        if (given) return parser.wrong(fmt::format("--turntable: {} is for one picture; leave one of them out", name));
    return {};
}

Status check_combinations(const OptionParser& parser, const RenderSettings& settings) {
    const RenderOptions& options = settings.options;
    if (settings.output.empty()) return parser.wrong("-o is missing; name the picture to write");
    if (options.checkpoint.resume && options.checkpoint.file.empty()) return parser.wrong("--resume: from which file? Name it with --checkpoint");
    RAYPAGER_TRY(check_inputs(parser, settings));
    if (!options.record.file.empty() && options.spp == 0 && options.time_seconds > 0)
        return parser.wrong("--record-trace: needs --spp as well as --time: the share of paths to record follows from how many there can be");
    if (settings.trace_paths_given && options.record.file.empty())
        return parser.wrong("--trace-paths: says how much to record; name a file with --record-trace");
    return check_distinct_files(parser, settings);
}

}  // namespace

// Options that decide how this one render pages; none of them changes the picture.
void add_paging_options(OptionParser& parser, RenderSettings& settings) {
    RenderOptions& options = settings.options;
    parser.option("geometry-limit", "SIZE|%",
                  "geometry and images of textures resident at once at most, in bytes or as a share of the scene's (default: what the "
                  "memory limit leaves)",
                  [&options](const std::string& text) -> Status {
                      const auto limit = parse_size_or_percent(text);
                      if (!limit) return limit.status();
                      options.geometry_limit = limit->bytes;
                      options.geometry_limit_percent = limit->percent;
                      return {};
                  });
    parser.option("paths", "N", "path slots: paths in flight at once (default: chosen from the limits)",
                  into_count(options.tuning.paths, 1, max_paths));
    parser.option("policy", "NAME", "which blocks come and go: aged-wants, most-wanted, wanted-per-byte, lru or sweep (default: aged-wants)",
                  into(options.tuning.policy, parse_policy));
    parser.option("connection", "NAME",
                  "shadow rays: in a queue of their own, or by roulette against path continuation: queue or roulette "
                  "(default: queue)",
                  into(options.connection, parse_connection));
    parser.option("traversal", "NAME",
                  "rays one by one or in streams, over blocks in the form for either: auto, ray or stream (default: auto, streams on CPUs)",
                  into(options.tuning.traversal, parse_traversal));
}

void add_layer_options(OptionParser& parser, RenderSettings& settings) {
    parser.option("layers", "LIST",
                  "channels beside the picture's in an .exr file: albedo, normal, depth, position, object, instance, material, samples, variance, "
                  "waits, or all (default: none)",
                  into(settings.options.layers, parse_film_layers));
    parser.flag(
        "denoise",
        "take the noise out of the picture with Intel's Open Image Denoise, which must be installed; its film has the layers albedo and normal, "
        "too, 52 bytes more per pixel",
        settings.denoise);
}

void add_exposure_options(OptionParser& parser, RenderSettings& settings) {
    parser.option("background", "SPEC",
                  "what the camera sees where nothing is, instead of the sky: R,G,B (linear radiance), #rrggbb (sRGB), or transparent, which gives "
                  ".exr and .png an alpha channel; all else is lit by the sky as ever (default: the sky)",
                  keeping_text(settings.texts.background, into(settings.options.background, parse_background)));
    parser.option("exposure", "EV", "the picture is multiplied by 2^EV, its background included, -64 to 64 (default: 0)",
                  into(settings.exposure, [](const std::string& text) -> Result<double> {
                      const auto stops = parse_finite(text);
                      if (!stops || !(std::abs(*stops) <= max_stops)) return Status::usage(fmt::format("'{}' is not a number from -64 to 64", text));
                      return *stops;
                  }));
}

void add_baking_options(OptionParser& parser, RenderSettings& settings) {
    parser.option("cache-dir", "DIR", "folder for baked scenes (default: beside the input; if not writable, the user's cache folder)",
                  into_optional_path(settings.cache_directory));
    add_point_options(parser, settings.bake.points);
}

Status check_inputs(const OptionParser& parser, const RenderSettings& settings) {
    const RenderOptions& options = settings.options;
    if (options.memory_limit > 0 && options.geometry_limit > options.memory_limit)
        return parser.wrong("--geometry-limit: is more than --memory-limit, which covers all device memory; make it smaller");
    for (const auto& input : settings.inputs)
        if (has_ending(input, ".rpb") && settings.inputs.size() > 1)
            return parser.wrong(fmt::format("'{}' is a block file, which cannot be rendered together with other inputs", input.string()));
    if (has_ending(settings.inputs.front(), ".rpb") && changes_points(settings.bake.points))
        return parser.wrong(
            fmt::format("'{}' is a block file; what becomes of points is decided when it is baked", settings.inputs.front().string()));
    return {};
}

Status check_distinct_files(const OptionParser& parser, const RenderSettings& settings) {
    std::vector<std::pair<const char*, std::filesystem::path>> files;
    for (const auto& input : settings.inputs) files.emplace_back("INPUT", input);
    if (settings.reference) files.emplace_back("--reference", *settings.reference);
    const size_t read_only = files.size();
    if (!settings.output.empty()) files.emplace_back("-o", settings.output);
    if (settings.log) files.emplace_back("--log", *settings.log);
    if (settings.report) files.emplace_back("--report", *settings.report);
    if (const auto& checkpoint = settings.options.checkpoint.file; !checkpoint.empty()) files.emplace_back("--checkpoint", checkpoint);
    if (const auto& trace = settings.options.record.file; !trace.empty()) files.emplace_back("--record-trace", trace);
    for (size_t i = read_only; i < files.size(); ++i)
        for (size_t j = 0; j < i; ++j)
            if (same_file(files[i].second, files[j].second))
                return parser.wrong(
                    fmt::format("{} and {} are the same file, {}; name another", files[j].first, files[i].first, files[i].second.string()));
    return {};
}

void add_picture_options(OptionParser& parser, RenderSettings& settings) {
    RenderOptions& options = settings.options;
    add_view_options(parser, options.width, options.height, settings.camera);
    parser.option("spp", "N", "samples per pixel, 1 to 65535 (default: as the scene says; with --time: until then)",
                  into_count(options.spp, 1, max_samples));
    parser.option("time", "SECONDS", "stop after about this long (default: no limit)", into(options.time_seconds, parse_seconds));
    parser.option("max-depth", "N", "scattering events of a path at most; 0 shows only what shines itself (default: as the scene says)",
                  into(options.max_depth, [](const std::string& text) { return parse_count(text, 0, deepest); }));
    parser.option("seed", "N", "seed of the random numbers, 0 to 2^32 - 1 (default: 0)", into_count(options.seed, 0, 0xffffffffu));
}

void add_device_options(OptionParser& parser, RenderSettings& settings) {
    RenderOptions& options = settings.options;
    parser.option("device", "N|NAME|LIST",
                  "number or part of the name, as 'raypager devices' lists them (default: the one marked there); several: 0,1 or all",
                  into(options.device, [](const std::string& text) -> Result<std::string> {
                      if (text.empty()) return Status::usage("is empty; give a number or part of a name");
                      return text;
                  }));
    parser.flag("allow-different", "several devices may be of different kinds; then the last bits of the picture depend on chance",
                options.allow_different);
    parser.option("memory-limit", "SIZE",
                  "device memory of the whole process at most, on each device (default: three quarters of what the device has; on a CPU half of main "
                  "memory, or less if less is free)",
                  into(options.memory_limit, parse_size));
    parser.option("host-limit", "SIZE",
                  "host memory for blocks read from the file, and for baking before, which takes 16M or more (default: half of what there is, or "
                  "less if less is free)",
                  into(options.host_limit, parse_size));
}

void add_tuning_options(OptionParser& parser, RenderSettings& settings) {
    RenderOptions& options = settings.options;
    parser.option("loads-in-flight", "N",
                  "blocks on their way at once while others must leave for them (default: by pool and blocks, 2 to 16 on CPUs, to 64 on GPUs)",
                  into_count(options.tuning.loads_in_flight, 1, max_loads));
    parser.option("hold", "PERCENT",
                  "no block leaves for another while more than this share of the path slots can go on, 0% to 100% (default: by policy, 40% or 100%)",
                  into(options.tuning.hold_above_ready, parse_share));
    parser.flag("wait-for-loads", "each round waits for the blocks that were on their way before it", options.tuning.wait_for_loads);
    parser.option("tile", "PIXELS",
                  "camera paths start in tiles of this many pixels a side (default: 16, on GPUs 128 in regions where not all is resident)",
                  into_count(options.tuning.tile_size, 1, 1024));
    parser.option("together", "N",
                  "samples of a pixel that are begun one after the other, 1 to 64 (default: up to 16; 1 with --time, --snapshots, --log or "
                  "--checkpoint, and in bench sweep); a resumed render keeps its order",
                  into_count(options.tuning.together, 1, 64));
    parser.option("region", "PIXELS",
                  "this many pixels get most of their samples before the next ones begin; 0: all pixels at once (default: by path slots in "
                  "long renders without --time, --snapshots, --log and --checkpoint, 0 in others); a resumed render keeps its order",
                  into(options.tuning.region, [](const std::string& text) { return parse_count(text, 0, uint64_t{1} << 31); }));
    add_tune_option(parser, options.tuning.profile);
}

Result<std::optional<RenderSettings>> parse_render_settings(const Arguments& arguments) {
    RenderSettings settings;
    std::vector<std::string> inputs;
    OptionParser parser("render", "INPUT... -o OUT.exr|OUT.png|OUT.pfm [options]", about_render);
    parser.inputs("INPUT", 1, std::numeric_limits<size_t>::max(), inputs);
    parser.option("output,o", "FILE", "picture to write: .exr, .png or .pfm", into_path(settings.output));
    add_picture_options(parser, settings);
    add_look_options(parser, settings.look, settings.texts);
    add_developing_options(parser, settings);
    add_device_options(parser, settings);
    add_paging_options(parser, settings);
    add_output_options(parser, settings);
    add_checkpoint_options(parser, settings);
    add_measurement_options(parser, settings);
    add_tuning_options(parser, settings);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return std::optional<RenderSettings>();
    settings.inputs.assign(inputs.begin(), inputs.end());
    RAYPAGER_TRY(check_combinations(parser, settings));
    RAYPAGER_TRY(check_look_options(parser, settings.look, settings.inputs));
    RAYPAGER_TRY(check_picture_options(parser, settings));
    return std::optional(std::move(settings));
}

Result<RenderOptions> effective_options(const RenderSettings& settings, const Blocks& scene) {
    RenderOptions options = settings.options;
    if (options.width == 0) {
        options.width = scene.width();
        options.height = scene.height();
    }
    if (settings.paper_preset && options.tuning.paths == 0) options.tuning.paths = paper_paths_per_pixel * options.width * options.height;
    // With a time limit alone, samples are taken for as long as there is time.
    if (options.spp == 0) options.spp = options.time_seconds > 0 ? static_cast<uint32_t>(max_samples) : scene.spp();
    const auto camera = choose_camera(settings.camera, scene.camera(), scene.width(), scene.height(), options.width, options.height);
    if (!camera) return camera.status().at("render");
    options.camera = *camera;
    if (settings.denoise) {
        options.layers.add(FilmLayer::albedo);
        options.layers.add(FilmLayer::normal);
    }
    return options;
}

}  // namespace raypager
