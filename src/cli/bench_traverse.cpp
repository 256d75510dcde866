#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "cli/bench.hpp"
#include "cli/traverse_options.hpp"
#include "cli/tune_option.hpp"

namespace raypager {
namespace {

constexpr const char* about_traverse =
    "Times the tracing stages of the engine on rays that lie on the device, everything resident: camera rays, one diffuse bounce\n"
    "from each of their hits, and a shadow ray from each to a box of light. Median of the repeats. With --ceiling, rays that\n"
    "miss the scene have a bounce and a shadow ray, too.";

std::string table(const bench::TraverseResult& result) {
    std::string text = fmt::format("{}, {:.1f} bytes per primitive\n{:<10} {:>12} {:>12} {:>10}\n", result.device, result.bytes_per_primitive, "rays",
                                   "number", "that hit", "Mrays/s");
    for (const bench::RaySetResult& set : result.sets)
        text +=
            fmt::format("{:<10} {:>12} {:>12} {:>10.1f}\n", set.name, format_count(set.rays), format_count(set.hits), set.rays_per_second() * 1e-6);
    return text;
}

nlohmann::json to_json(const bench::TraverseResult& result, const bench::TraverseOptions& options) {
    const auto box = [](const auto& corners) {
        if (!corners) return nlohmann::json();
        const auto& [low, high] = *corners;
        return nlohmann::json({low.x, low.y, low.z, high.x, high.y, high.z});
    };
    nlohmann::json sets = nlohmann::json::array();
    for (const bench::RaySetResult& set : result.sets)
        sets.push_back(
            {{"name", set.name}, {"rays", set.rays}, {"hits", set.hits}, {"seconds", set.seconds}, {"rays_per_second", set.rays_per_second()}});
    return {{"raypager", RAYPAGER_VERSION},
            {"size", {options.width, options.height}},
            {"light", box(options.light)},
            {"ceiling", box(options.ceiling)},
            {"device", result.device},
            {"bytes_per_primitive", result.bytes_per_primitive},
            {"sets", sets}};
}

}  // namespace

Status run_bench_traverse(const Arguments& arguments) {
    TraverseSettings settings;
    std::filesystem::path report;
    OptionParser parser("bench traverse", "FILE.rpb [options]", about_traverse);
    add_traverse_options(parser, settings);
    parser.option("device", "D", "number or part of the name, as 'raypager devices' lists them (default: its default)",
                  [&](const std::string& text) { return settings.options.device = text, Status(); });
    parser.option("memory-limit", "SIZE", "all device memory (default: as in render)", into(settings.options.memory_limit, parse_size));
    add_tune_option(parser, settings.options.tuning);
    parser.option("report", "FILE", "write the figures as JSON", into_path(report));
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};

    const auto file = BlockFile::open(settings.inputs.front());
    if (!file) return file.status();
    const auto result = bench::measure_traversal(**file, traverse_options(settings));
    if (!result) return result.status();
    std::fputs(table(*result).c_str(), stdout);
    if (report.empty()) return {};
    return write_text(report, to_json(*result, traverse_options(settings)).dump(2) + "\n");
}

}  // namespace raypager
