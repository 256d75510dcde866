#include "cli/render_settings.hpp"

#include <fmt/format.h>

#include <limits>

#include "cli/output_paths.hpp"
#include "cli/point_options.hpp"
#include "cli/view.hpp"
#include "raypager/abi/types.h"

namespace raypager {
namespace {

constexpr uint64_t most_samples = 65536;  // what the film's fixed point holds without overflow (abi/film.h)
constexpr uint64_t most_paths = uint64_t{1} << 30;
constexpr uint64_t deepest = 60000;  // path state counts scattering events in 16 bits

constexpr const char* about =
    "Renders a picture. INPUT is a block file (.rpb), a .pbrt scene, or any number of meshes (.ply .obj .stl .off) and point\n"
    "clouds (.las .ply .xyz .pts .txt), which are framed, lit and given a ground. What is not baked is baked first; the block file is kept beside "
    "the input and used again.";

Result<PolicyKind> parse_policy(const std::string& text) {
    if (const auto kind = policy_from_name(text)) return *kind;
    return Status::usage(fmt::format("'{}' is no policy; use aged-wants, most-wanted, wanted-per-byte or lru", text));
}

Result<Connection> parse_connection(const std::string& text) {
    if (text == "queue") return Connection::queue;
    if (text == "roulette") return Connection::roulette;
    return Status::usage(fmt::format("'{}' is no way of connecting; use queue or roulette", text));
}

OptionParser::Setter into_optional_path(std::optional<std::filesystem::path>& target) {
    return [&target](const std::string& text) {
        target.emplace();
        return into_path(*target)(text);
    };
}

// Options that decide what the picture shows and how good it gets.
void add_picture_options(OptionParser& parser, RenderSettings& settings) {
    RenderOptions& options = settings.options;
    parser.option("output,o", "FILE", "picture to write: .exr, .png or .pfm", into_path(settings.output));
    add_view_options(parser, options.width, options.height, settings.camera);
    parser.option("spp", "N", "samples a pixel, 1 to 65536 (default: as the scene says; with --time: until then)",
                  into_count(options.spp, 1, most_samples));
    parser.option("time", "SECONDS", "stop after about so long (default: no limit)", into(options.time_seconds, parse_seconds));
    parser.option("max-depth", "N", "scattering events of a path at most; 0 shows only what shines itself (default: as the scene says)",
                  into(options.max_depth, [](const std::string& text) { return parse_count(text, 0, deepest); }));
    parser.option("seed", "N", "seed of the random numbers, 0 to 2^32 - 1 (default: 0)", into_count(options.seed, 0, 0xffffffffu));
}

// Options that decide where the work is done and in how much memory; none of them changes the picture.
void add_paging_options(OptionParser& parser, RenderSettings& settings) {
    RenderOptions& options = settings.options;
    parser.option("device", "N|NAME", "number or part of the name, as 'raypager devices' lists them (default: the one marked there)",
                  into(options.device, [](const std::string& text) -> Result<std::string> {
                      if (text.empty()) return Status::usage("is empty; give a number or part of a name");
                      return text;
                  }));
    parser.option("memory-limit", "SIZE", "device memory of the whole process at most (default: three quarters of what the device has)",
                  into(options.memory_limit, parse_size));
    parser.option("geometry-limit", "SIZE|%",
                  "geometry resident at once at most, in bytes or as a share of the scene's (default: what the "
                  "memory limit leaves)",
                  [&options](const std::string& text) -> Status {
                      const auto limit = parse_size_or_percent(text);
                      if (!limit) return limit.status();
                      options.geometry_limit = limit->bytes;
                      options.geometry_limit_percent = limit->percent;
                      return {};
                  });
    parser.option("host-limit", "SIZE", "host memory for blocks read from the file (default: half of what is free)",
                  into(options.host_limit, parse_size));
    parser.option("paths", "N", "path slots: paths in flight at once (default: chosen from the limits)", into_count(options.paths, 1, most_paths));
    parser.option("policy", "NAME", "which blocks come and go: aged-wants, most-wanted, wanted-per-byte or lru (default: aged-wants)",
                  into(options.policy, parse_policy));
    parser.option("connection", "NAME",
                  "shadow rays: in a queue of their own, or by roulette against path continuation: queue or roulette "
                  "(default: queue)",
                  into(options.connection, parse_connection));
}

void add_output_options(OptionParser& parser, RenderSettings& settings) {
    parser.option("snapshots", "SECONDS", "rewrite the picture so often while rendering (default: never)",
                  into(settings.snapshot_seconds, parse_seconds));
    parser.option("log", "FILE.csv",
                  "convergence log: seconds, spp, rmse, loads, bytes loaded, rays; a row a snapshot, or a second without "
                  "--snapshots",
                  into_optional_path(settings.log));
    parser.option("reference", "FILE", "picture of the same size to compare with: fills the log's rmse", into_optional_path(settings.reference));
    parser.option("report", "FILE.json", "what was done, with every figure, for scripts", into_optional_path(settings.report));
    parser.option("cache-dir", "DIR", "folder for baked scenes (default: beside the input; if not writable, the user's cache folder)",
                  into_optional_path(settings.cache_directory));
    add_point_options(parser, settings.bake.points);
    parser.flag("progress", "show progress even if stderr is no terminal", settings.progress);
}

void add_checkpoint_options(OptionParser& parser, RenderSettings& settings) {
    CheckpointOptions& checkpoint = settings.options.checkpoint;
    parser.option("checkpoint", "FILE",
                  "keep all work in this file: every so often, when the render is stopped (then at once), and at its end; it must not exist "
                  "yet, but for --resume",
                  into_path(checkpoint.file));
    parser.option("checkpoint-every", "SECONDS", "how often (default: 60)", into(checkpoint.every_seconds, parse_seconds));
    parser.flag("resume",
                "go on from the checkpoint, or start anew if there is none yet; scene and picture options must be the same, but --spp may be "
                "larger; limits, policy and paths may differ",
                checkpoint.resume);
}

// No file may be written twice, nor over something that is read.
Status check_distinct_files(const OptionParser& parser, const RenderSettings& settings) {
    std::vector<std::pair<const char*, std::filesystem::path>> files;
    for (const auto& input : settings.inputs) files.emplace_back("INPUT", input);
    if (settings.reference) files.emplace_back("--reference", *settings.reference);
    const size_t read_only = files.size();
    files.emplace_back("-o", settings.output);
    if (settings.log) files.emplace_back("--log", *settings.log);
    if (settings.report) files.emplace_back("--report", *settings.report);
    if (const auto& checkpoint = settings.options.checkpoint.file; !checkpoint.empty()) files.emplace_back("--checkpoint", checkpoint);
    for (size_t i = read_only; i < files.size(); ++i)
        for (size_t j = 0; j < i; ++j)
            if (same_file(files[i].second, files[j].second))
                return parser.wrong(
                    fmt::format("{} and {} are the same file, {}; name another", files[j].first, files[i].first, files[i].second.string()));
    return {};
}

Status check_combinations(const OptionParser& parser, const RenderSettings& settings) {
    const RenderOptions& options = settings.options;
    if (settings.output.empty()) return parser.wrong("-o is missing; name the picture to write");
    if (options.checkpoint.resume && options.checkpoint.file.empty()) return parser.wrong("--resume: from which file? Name it with --checkpoint");
    if (options.memory_limit > 0 && options.geometry_limit > options.memory_limit)
        return parser.wrong("--geometry-limit: is more than --memory-limit, which covers all device memory; make it smaller");
    for (const auto& input : settings.inputs)
        if (has_ending(input, ".rpb") && settings.inputs.size() > 1)
            return parser.wrong(fmt::format("'{}' is a block file, which cannot be rendered together with other inputs", input.string()));
    if (has_ending(settings.inputs.front(), ".rpb") && changes_points(settings.bake.points))
        return parser.wrong(
            fmt::format("'{}' is a block file; what becomes of points is decided when it is baked", settings.inputs.front().string()));
    return check_distinct_files(parser, settings);
}

}  // namespace

Result<std::optional<RenderSettings>> parse_render_settings(const Arguments& arguments) {
    RenderSettings settings;
    std::vector<std::string> inputs;
    OptionParser parser("render", "INPUT... -o OUT.exr|OUT.png|OUT.pfm [options]", about);
    parser.inputs("INPUT", 1, std::numeric_limits<size_t>::max(), inputs);
    add_picture_options(parser, settings);
    add_paging_options(parser, settings);
    add_output_options(parser, settings);
    add_checkpoint_options(parser, settings);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return std::optional<RenderSettings>();
    settings.inputs.assign(inputs.begin(), inputs.end());
    RAYPAGER_TRY(check_combinations(parser, settings));
    return std::optional(std::move(settings));
}

Result<RenderOptions> effective_options(const RenderSettings& settings, const BakedScene& scene) {
    RenderOptions options = settings.options;
    if (options.width == 0) {
        options.width = scene.width;
        options.height = scene.height;
    }
    // With a time limit alone, samples are taken for as long as there is time.
    if (options.spp == 0) options.spp = options.time_seconds > 0 ? static_cast<uint32_t>(most_samples) : scene.spp;
    const auto camera = choose_camera(settings.camera, scene.camera, scene.width, scene.height, options.width, options.height);
    if (!camera) return camera.status().at("render");
    options.camera = *camera;
    return options;
}

}  // namespace raypager
