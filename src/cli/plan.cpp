#include <fmt/format.h>

#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "base/log.hpp"
#include "cli/bench_lists.hpp"
#include "cli/developing.hpp"
#include "cli/look_options.hpp"
#include "cli/output_paths.hpp"
#include "cli/plan_nodes.hpp"
#include "cli/ranks.hpp"
#include "cli/render_settings.hpp"
#include "cli/report.hpp"
#include "cli/scene_cache.hpp"
#include "cli/stop_signal.hpp"
#include "cli/values.hpp"
#include "cli/verbs.hpp"
#include "raypager/cluster_forecast.hpp"
#include "raypager/forecast.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* about_plan =
    "Says what a render would take before it is made: seconds, bytes moved onto the device, and how much slower it would be than with everything\n"
    "resident; what other limits would do to it; and which one would halve what the limit costs. Short parts of the very render, spread over all of\n"
    "it, are rendered within each limit and timed; where the device has it, with more memory than --memory-limit says. INPUT and options are those "
    "of\n"
    "'raypager render', without --time, --adaptive and checkpoints.";

struct PlanSettings {
    RenderSettings render;
    ForecastOptions forecast;
    PlanNodes nodes;
};

Result<std::optional<PlanSettings>> parse_plan_settings(const Arguments& arguments) {
    PlanSettings settings;
    RenderSettings& render = settings.render;
    std::vector<std::string> inputs;
    OptionParser parser("plan", "INPUT... [options]", about_plan);
    parser.inputs("INPUT", 1, std::numeric_limits<size_t>::max(), inputs);
    parser.option("limits", "LIST",
                  "other geometry limits to compare with, in bytes or percent (default: twice, four times and half of what is resident)",
                  into_list(settings.forecast.limits, [](const std::string& text) -> Result<GeometryLimit> {
                      const auto limit = parse_size_or_percent(text);
                      if (!limit) return limit.status();
                      return GeometryLimit{limit->bytes, limit->percent};
                  }));
    parser.option("effort", "SECONDS", "how long to measure, about: each limit at least once, three times at most (default: 20)",
                  into(settings.forecast.seconds, parse_seconds));
    add_node_options(parser, settings.nodes);
    parser.option("report", "FILE.json", "every figure, for scripts", [&render](const std::string& text) {
        render.report.emplace();
        return into_path(*render.report)(text);
    });
    add_picture_options(parser, render);
    add_exposure_options(parser, render);
    add_layer_options(parser, render);
    add_look_options(parser, render.look, render.texts);
    add_device_options(parser, render);
    add_paging_options(parser, render);
    add_baking_options(parser, render);
    parser.flag("progress", "show progress even if stderr is not a terminal", render.progress);
    add_tuning_options(parser, render);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return std::optional<PlanSettings>();
    render.inputs.assign(inputs.begin(), inputs.end());
    RAYPAGER_TRY(check_inputs(parser, render));
    RAYPAGER_TRY(check_distinct_files(parser, render));
    RAYPAGER_TRY(check_look_options(parser, render.look, render.inputs));
    RAYPAGER_TRY(check_node_options(parser, settings.nodes));
    if (render.options.time_seconds > 0) return parser.wrong("--time: a plan is of a number of samples; give --spp in its place");
    return std::optional(std::move(settings));
}

double share_of(uint64_t part, uint64_t whole) { return whole ? static_cast<double>(part) / static_cast<double>(whole) : 1; }

std::string row_text(const ForecastRow& row, const Forecast& forecast) {
    const bool asked = row.geometry_bytes == forecast.asked.geometry_bytes;
    return fmt::format("{} {:>10} {:>8} {:>14} {:>10} {:>10} {:>10.2f}{}\n", asked ? '>' : ' ', format_bytes(row.geometry_bytes),
                       format_share(share_of(row.geometry_bytes, forecast.scene_bytes)), format_bytes(row.memory_bytes), format_duration(row.seconds),
                       format_bytes(static_cast<uint64_t>(row.moved_bytes)), row.slow_down,
                       row.measured ? "" : "  by a model: more than renders take of this device");
}

// memory_limit: of the options, 0 if there is none. What a larger limit takes beside, it takes within the smaller one, too.
std::string limit_text(const char* what, uint64_t limit, const Forecast& forecast, uint64_t memory_limit) {
    const uint64_t memory = forecast.asked.memory_bytes - std::min(forecast.asked.memory_bytes, forecast.asked.geometry_bytes) + limit;
    const bool too_much = memory_limit > 0 && memory > memory_limit;
    return fmt::format("  {}: --geometry-limit {}K{} ({})\n", what, (limit + 1023) / 1024,
                       too_much ? fmt::format(", with a --memory-limit of about {}M", (memory >> 20) + 1) : "",
                       format_share(share_of(limit, forecast.scene_bytes)));
}

std::string forecast_text(const Forecast& forecast, uint64_t memory_limit) {
    std::string text = fmt::format("{}x{}, {} spp on {}: {} of rendering, {} moved, {:.2f} times as long as with everything resident\n",
                                   forecast.width, forecast.height, forecast.spp, forecast.device, format_duration(forecast.asked.seconds),
                                   format_bytes(static_cast<uint64_t>(forecast.asked.moved_bytes)), forecast.asked.slow_down);
    text += fmt::format("  {:>10} {:>8} {:>14} {:>10} {:>10} {:>10}\n", "resident", "share", "device memory", "time", "moved", "slow-down");
    for (const ForecastRow& row : forecast.rows) text += row_text(row, forecast);
    if (forecast.halves_excess) text += limit_text("half of what the limit costs", *forecast.halves_excess, forecast, memory_limit);
    if (forecast.halves_time) text += limit_text("half of the time", *forecast.halves_time, forecast, memory_limit);
    if (!forecast.halves_excess) text += "  a larger limit would gain nothing\n";
    constexpr double quiet = 1.05;
    if (forecast.noise > quiet)
        text += fmt::format("  more memory took up to {:.2f} times as long as less: other programs disturb the measurement\n", forecast.noise);
    text += fmt::format("  from {} of the samples, measured in {}\n", format_share(share_of(forecast.samples_measured, forecast.samples)),
                        format_duration(forecast.seconds));
    return text;
}

Json row_json(const ForecastRow& row) {
    return {{"geometry_bytes", row.geometry_bytes}, {"memory_bytes", row.memory_bytes}, {"paths", row.paths},      {"seconds", row.seconds},
            {"bytes_loaded", row.moved_bytes},      {"slow_down", row.slow_down},       {"measured", row.measured}};
}

Json plan_json(const PlanSettings& settings, const RenderOptions& options, const Blocks& scene, const Forecast& forecast) {
    const auto maybe = [](const std::optional<uint64_t>& limit) { return limit ? Json(*limit) : Json(nullptr); };
    Json inputs = Json::array(), rows = Json::array();
    for (const auto& input : settings.render.inputs) inputs.push_back(input.string());
    for (const ForecastRow& row : forecast.rows) rows.push_back(row_json(row));
    return {
        {"raypager", RAYPAGER_VERSION},
        {"input", inputs},
        {"device", forecast.device},
        {"scene",
         {{"triangles", scene.triangles()}, {"spheres", scene.spheres()}, {"blocks", scene.count()}, {"geometry_bytes", forecast.scene_bytes}}},
        {"image", {{"width", forecast.width}, {"height", forecast.height}, {"spp", forecast.spp}}},
        {"layers", options.layers.any() ? Json(film_layer_list(options.layers)) : Json(nullptr)},
        {"limits", {{"memory", options.memory_limit}, {"geometry", options.geometry_limit}, {"geometry_percent", options.geometry_limit_percent}}},
        {"asked", row_json(forecast.asked)},
        {"resident", row_json(forecast.resident)},
        {"rows", rows},
        {"halves_excess_bytes", maybe(forecast.halves_excess)},
        {"halves_time_bytes", maybe(forecast.halves_time)},
        {"noise", forecast.noise},
        {"samples", forecast.samples},
        {"samples_measured", forecast.samples_measured},
        {"seconds", forecast.seconds}};
}

Status plan(const PlanSettings& settings) {
    const RenderSettings& render = settings.render;
    if (render.report) RAYPAGER_TRY(check_output_path(*render.report));
    const StopSignal signal(StopMode::leave);
    const bool show_progress = render.progress || stderr_is_terminal();
    BakeRequest request = {render.bake, {render.options.width, render.options.height, render.camera}, show_progress, render.look};
    if (render.options.host_limit) request.options.host_limit = std::max(render.options.host_limit, smallest_bake_limit(request.options.block_bytes));
    const auto opened = open_scene(render.inputs, render.cache_directory, request);
    if (!opened) return opened.status();
    const auto options = effective_options(render, opened->blocks);
    if (!options) return options.status();
    signal.set_mode(StopMode::finish);
    ForecastOptions how = settings.forecast;
    how.stop = &signal.stop();
    if (show_progress) how.progress = [](double fraction) { progress_line(fmt::format("measuring: {:.0f} %", 100 * fraction)); };
    ClusterForecastOptions how_nodes = settings.nodes.how;
    how_nodes.stop = how.stop;
    if (show_progress) how_nodes.progress = [](double fraction) { progress_line(fmt::format("simulating: {:.0f} %", 100 * fraction)); };
    const bool with_nodes = !how_nodes.nodes.empty();
    if (with_nodes) RAYPAGER_TRY(check_cluster_forecast(opened->blocks));
    const auto result = forecast(opened->blocks, *options, how);
    progress_line("");
    if (!result) return result.status();
    Json json = plan_json(settings, *options, opened->blocks, *result);
    std::string text = forecast_text(*result, options->memory_limit);
    if (with_nodes) {
        const auto nodes = forecast_cluster(opened->blocks, *options, *result, how_nodes);
        progress_line("");
        if (!nodes) return nodes.status();
        text += nodes_text(*nodes, how_nodes.link);
        json["cluster"] = nodes_json(*nodes, how_nodes.link);
    }
    std::fputs(text.c_str(), stdout);
    return render.report ? write_text(*render.report, json_text(json)) : Status();
}

}  // namespace

Status run_plan(const Arguments& arguments) {
    auto settings = parse_plan_settings(arguments);
    if (!settings) return settings.status();
    if (!*settings) return {};
    RAYPAGER_TRY(choose_denoiser((*settings)->render));
    return run_in_ranks([&settings](const std::shared_ptr<Peers>& peers, bool&) {
        return peers ? Status::usage("plan: is for one process; start it without mpirun") : plan(**settings);
    });
}

}  // namespace raypager
