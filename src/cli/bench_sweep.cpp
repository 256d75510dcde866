#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "base/log.hpp"
#include "bench/sweep_figures.hpp"
#include "cli/bench.hpp"
#include "cli/bench_lists.hpp"
#include "cli/output_paths.hpp"
#include "cli/render_settings.hpp"
#include "cli/report.hpp"
#include "cli/scene_cache.hpp"
#include "cli/stop_signal.hpp"
#include "cli/sweep_state.hpp"
#include "cli/values.hpp"
#include "raypager/baselines.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;
using bench::SweepPolicy;

constexpr const char* about_sweep =
    "Renders a scene at every combination of the lists, against one reference that it makes and keeps, and writes into DIR: sweep.csv,\n"
    "convergence.csv, residency.csv and sweep.json, which bench/plot_sweep.py draws. Exit status 1 if films differ that must be the same.\n"
    "Beside the policies of render, --policies takes 'paper' (the paper's settings) and 'host' (all geometry in mapped host memory,\n"
    "no paging).";

struct SweepGiven {
    std::vector<std::string> inputs;
    std::filesystem::path folder;
    RenderSettings render;
    bench::SweepSettings sweep;
    std::string command;
    bool resume = false;
};

Result<SweepPolicy> parse_sweep_policy(const std::string& text) {
    if (text == "paper") return SweepPolicy{PolicyKind::most_wanted, SweepPolicy::Baseline::paper};
    if (text == "host") return SweepPolicy{PolicyKind::aged_wants, SweepPolicy::Baseline::host};
    const auto kind = parse_policy(text);
    if (!kind) return Status::usage(kind.status().message() + ", paper or host");
    return SweepPolicy{*kind, SweepPolicy::Baseline::none};
}

Result<bench::SweepPaths> parse_sweep_paths(const std::string& text) {
    if (text == "auto") return bench::SweepPaths();
    const bool per_pixel = text.ends_with('x');
    const auto count = parse_count(per_pixel ? text.substr(0, text.size() - 1) : text, 1, uint64_t{1} << 30);
    if (!count) return Status::usage(count.status().message() + ", with an x after it for that many per pixel, or auto");
    const auto number = static_cast<uint32_t>(*count);
    return per_pixel ? bench::SweepPaths{0, number} : bench::SweepPaths{number, 0};
}

Result<bench::SweepLimit> parse_sweep_limit(const std::string& text) {
    const auto limit = parse_size_or_percent(text);
    if (!limit) return limit.status();
    return bench::SweepLimit{limit->bytes, limit->percent};
}

Result<OptionParser::Outcome> parse(const Arguments& arguments, SweepGiven& given) {
    bench::SweepSettings& sweep = given.sweep;
    sweep.limits = {{0, 100}, {0, 50}, {0, 25}, {0, 12.5}, {0, 3}};
    sweep.policies = {{}};
    sweep.paths = {{}};
    sweep.connections = {Connection::queue};
    sweep.reference.spp = 0;
    OptionParser parser("bench sweep", "INPUT... -o DIR [options]", about_sweep);
    parser.inputs("INPUT", 1, 1000000, given.inputs);
    parser.option("output,o", "DIR", "folder for the results; made if absent", into_path(given.folder));
    parser.option("limits", "LIST", "--geometry-limit of the runs, in bytes or % (default: 100%,50%,25%,12.5%,3%)",
                  into_list(sweep.limits, parse_sweep_limit));
    parser.option("policies", "LIST", "policies and baselines (default: aged-wants)", into_list(sweep.policies, parse_sweep_policy));
    parser.option("paths", "LIST", "path slots: numbers, multiples of the pixels such as 4x, or auto (default: auto)",
                  into_list(sweep.paths, parse_sweep_paths));
    parser.option("connections", "LIST", "queue, roulette (default: queue)",
                  into_list(sweep.connections, [](const std::string& text) { return parse_connection(text); }));
    parser.option("repeats", "N", "times that everything is done, interleaved (default: 3)", into_count(sweep.repeats, 1, 1000));
    parser.option("reference-spp", "N", "samples per pixel of the reference (default: 16 times --spp, 1024 with --time alone)",
                  into_count(sweep.reference.spp, 1, 65535));
    parser.option("snapshots", "SECONDS", "when the convergence curve has its first point; later ones are farther apart (default: 0.05)",
                  into(sweep.first_snapshot, parse_seconds));
    parser.option("cache-dir", "DIR", "folder for baked scenes and references (default: beside the input; if not writable, the results' folder)",
                  [&given](const std::string& text) {
                      given.render.cache_directory.emplace();
                      return into_path(*given.render.cache_directory)(text);
                  });
    parser.flag("resume", "go on with a sweep that was stopped: finished runs, kept in DIR/sweep.runs, are not made again", given.resume);
    add_picture_options(parser, given.render);
    add_device_options(parser, given.render);
    add_tuning_options(parser, given.render);
    const auto outcome = parser.parse(arguments);
    if (!outcome || *outcome == OptionParser::Outcome::help_shown) return outcome;
    if (given.folder.empty()) return parser.wrong("-o is missing; name a folder for the results");
    return outcome;
}

std::string as_typed(const Arguments& arguments) {
    std::string command = "raypager bench sweep";
    for (const std::string& argument : arguments)
        command += argument.find_first_of(" '\"$*") == std::string::npos ? " " + argument : " '" + argument + "'";
    return command;
}

// Where the reference is kept: with the baked scene if possible.
std::filesystem::path reference_folder(const SweepGiven& given) {
    if (given.render.cache_directory) return *given.render.cache_directory;
    const std::filesystem::path beside = folder_of(given.inputs.front());
    return folder_is_writable(beside) ? beside : given.folder;
}

Status make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (std::filesystem::is_directory(folder, error) && folder_is_writable(folder)) return {};
    return Status::failed(fmt::format("{}: the folder cannot be made or written to; name another with -o", folder.string()));
}

Json run_json(const bench::SweepResult& result, const bench::SweepRun& run) {
    const bench::SweepVariant& v = result.variants[run.variant];
    const RenderReport& r = run.report;
    Json curve = Json::array();
    for (const bench::ConvergencePoint& point : run.convergence) curve.push_back({point.seconds, point.spp, point.rmse, point.bytes_loaded});
    return {{"variant", run.variant},
            {"limit", v.limit_name()},
            {"policy", v.policy.name()},
            {"paths", v.paths.name()},
            {"connection", r.connection},
            {"repeat", run.repeat + 1},
            {"pool_bytes", r.limits.geometry_bytes},
            {"path_slots", r.paths},
            {"spp", r.spp},
            {"seconds", run.seconds},
            {"trace_seconds", r.seconds.trace},
            {"stall_seconds", r.seconds.stall},
            {"rays", r.rays.total()},
            {"rounds", r.paging.rounds},
            {"loads", r.paging.loads},
            {"evictions", r.paging.evictions},
            {"bytes_loaded", r.paging.bytes_loaded},
            {"wants_without_hit", r.paging.requests_without_hit},
            {"peak_memory_bytes", r.peak.memory_bytes},
            {"film_hash", hex64(r.film_hash)},
            {"timeline_seconds", run.round_seconds.empty() ? Json(nullptr) : Json(run.round_seconds.back())},
            {"convergence", curve}};
}

Json sweep_json(const SweepGiven& given, const bench::SweepResult& result, const Blocks& scene, const std::string& date) {
    const RenderReport& first = result.runs.front().report;
    const auto figures = bench::variant_figures(result);
    Json variants = Json::array(), runs = Json::array();
    for (size_t i = 0; i < figures.size(); i++) {
        const bench::VariantFigures& f = figures[i];
        variants.push_back({{"limit", result.variants[i].limit_name()},
                            {"settings", result.variants[i].settings_name()},
                            {"resident_percent", f.resident_percent},
                            {"seconds", f.seconds},
                            {"slow_down", f.slow_down},
                            {"stall_share", f.stall_share},
                            {"rays_per_second", f.rays_per_second},
                            {"bytes_loaded", f.bytes_loaded},
                            {"bytes_per_ray", f.bytes_per_ray},
                            {"loads", f.loads},
                            {"rounds", f.rounds},
                            {"rmse", f.rmse},
                            {"seconds_to_rmse", f.seconds_to_rmse ? Json(*f.seconds_to_rmse) : Json(nullptr)}});
    }
    for (const bench::SweepRun& run : result.runs) runs.push_back(run_json(result, run));
    return {
        {"raypager", RAYPAGER_VERSION},
        {"command", given.command},
        {"date", date},
        {"input", given.inputs},
        {"device", {{"name", first.device.name}, {"platform", first.device.platform}, {"driver", first.device.driver}, {"type", first.device.type}}},
        {"scene", scene_json(scene, first.form)},
        {"image", {{"width", first.width}, {"height", first.height}, {"max_depth", first.max_depth}, {"seed", first.seed}}},
        {"reference", {{"path", result.reference.path.string()}, {"spp", result.reference.spp}, {"seed", result.reference.seed}}},
        {"same_films", result.different_films.empty()},
        {"different_films", result.different_films},
        {"common_rmse", bench::common_rmse(result)},
        {"variants", variants},
        {"convergence_columns", {"seconds", "spp", "rmse", "bytes_loaded"}},
        {"runs", runs}};
}

Status write_results(const SweepGiven& given, const bench::SweepResult& result, const Blocks& scene) {
    const std::string date = fmt::format("{:%Y-%m-%d %H:%M}", fmt::localtime(std::time(nullptr)));
    RAYPAGER_TRY(write_text(given.folder / "sweep.csv", bench::runs_csv(result)));
    RAYPAGER_TRY(write_text(given.folder / "convergence.csv", bench::convergence_csv(result)));
    RAYPAGER_TRY(write_text(given.folder / "residency.csv", bench::residency_csv(result)));
    return write_text(given.folder / "sweep.json", json_text(sweep_json(given, result, scene, date)));
}

// Tables of what there is; medians need every run.
Status stopped_early(const SweepGiven& given, const bench::SweepResult& result) {
    if (!result.runs.empty()) {
        RAYPAGER_TRY(write_text(given.folder / "sweep.csv", bench::runs_csv(result)));
        RAYPAGER_TRY(write_text(given.folder / "convergence.csv", bench::convergence_csv(result)));
    }
    return Status::interrupted(fmt::format("stopped by a signal after {} of {}, which are kept in {}; go on with --resume",
                                           format_count(result.runs.size()), counted(bench::run_count(given.sweep), "run"), given.folder.string()));
}

}  // namespace

Status run_bench_sweep(const Arguments& arguments) {
    SweepGiven given;
    const auto outcome = parse(arguments, given);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    given.command = as_typed(arguments);
    RAYPAGER_TRY(make_folder(given.folder));
    const View view{given.render.options.width, given.render.options.height, given.render.camera};
    const auto opened =
        open_scene({given.inputs.begin(), given.inputs.end()}, given.render.cache_directory, {given.render.bake, view, stderr_is_terminal()});
    if (!opened) return opened.status();
    const auto options = effective_options(given.render, opened->blocks);
    if (!options) return options.status();
    given.sweep.base = *options;
    if (given.sweep.reference.spp == 0)
        given.sweep.reference.spp = given.render.options.time_seconds > 0 && !given.render.options.spp ? 1024 : std::min(65535u, 16 * options->spp);
    given.sweep.reference.folder = reference_folder(given);
    for (const SweepPolicy& policy : given.sweep.policies)
        if (const auto difference = paper_bake_difference(opened->blocks); difference && policy.baseline == SweepPolicy::Baseline::paper)
            log_note(*difference);

    auto state = SweepState::open(given.folder, given.sweep, opened->blocks.source().scene(), given.resume);
    if (!state) return state.status();
    if (!state->earlier().empty())
        log_note(fmt::format("going on with {} of {}", format_count(state->earlier().size()), counted(bench::run_count(given.sweep), "run")));
    const StopSignal signal(StopMode::finish);
    bench::SweepHooks hooks;
    hooks.note = [](const std::string& text) { progress_line("sweep: " + text); };
    hooks.finished = [&state](const bench::SweepRun& run, const bench::SweepVariant& variant) { return state->add(run, variant); };
    hooks.stop = &signal.stop();
    const auto result = bench::run_sweep(opened->blocks.source(), given.sweep, state->earlier(), hooks);
    progress_line("");
    if (!result) return result.status();
    if (result->stopped) return stopped_early(given, *result);
    RAYPAGER_TRY(state->finish());
    RAYPAGER_TRY(write_results(given, *result, opened->blocks));
    std::fputs(bench::sweep_table(*result).c_str(), stdout);
    log_note(fmt::format("results: {}", given.folder.string()));
    if (result->different_films.empty()) return {};
    return Status::failed(
        fmt::format("{} films differ that must be the same, the first: {}", result->different_films.size(), result->different_films.front()));
}

}  // namespace raypager
