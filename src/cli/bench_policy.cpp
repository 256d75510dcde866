#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "base/log.hpp"
#include "bench/policy_bench.hpp"
#include "cli/bench.hpp"
#include "cli/bench_lists.hpp"
#include "cli/report.hpp"
#include "cli/tune_option.hpp"
#include "cli/values.hpp"
#include "residency/demand_trace.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* about_policy =
    "Serves a demand trace (render --record-trace) again, under other policies and pools, without a device, and says what each would\n"
    "have moved. 'clairvoyant' is the furthest-next-use replacement on the same order of service; 'least' is what no schedule with\n"
    "these slots and this pool can go below. bench/README.md says what both mean and how the replay models time.";

struct PolicySettingsGiven {
    std::string trace;
    std::vector<SizeOrPercent> pools = {{0, 50}, {0, 25}, {0, 12.5}, {0, 3}};
    std::vector<PolicyKind> policies = all_policies();
    std::optional<std::filesystem::path> report;
    bench::PolicyBenchSettings bench;
};

Result<OptionParser::Outcome> parse(const Arguments& arguments, PolicySettingsGiven& given) {
    std::vector<std::string> inputs;
    OptionParser parser("bench policy", "TRACE [options]", about_policy);
    parser.inputs("the demand trace", 1, 1, inputs);
    parser.option("pools", "LIST", "sizes of the pool, in bytes or as shares of the geometry (default: 50%,25%,12.5%,3%)",
                  into_list(given.pools, parse_size_or_percent));
    parser.option("policies", "LIST", "names as for render, or all (default: all)", into_policies(given.policies));
    parser.option("paths", "N", "path slots of the whole render (default: as recorded)",
                  into(given.bench.slots, [](const std::string& text) { return parse_count(text, 1, uint64_t{1} << 30); }));
    parser.option("loads-in-flight", "N", "as for render (default: by pool and blocks)", into_count(given.bench.loads_in_flight, 1, 1024));
    parser.option("hold", "PERCENT", "as for render (default: by policy)", into(given.bench.hold_above_ready, parse_share));
    add_tune_option(parser, given.bench.tuning);
    parser.option("bandwidth", "SIZE", "bytes per second to the device (default: what was asked for after one round is there after the next)",
                  into(given.bench.bandwidth, parse_size));
    parser.option("ray-rate", "N", "rays per second with everything resident, for the model of time (default: as recorded)",
                  into(given.bench.ray_rate, [](const std::string& text) { return parse_count(text, 1, uint64_t{1} << 50); }));
    parser.option("report", "FILE.json", "every figure, for scripts", [&given](const std::string& text) {
        given.report.emplace();
        return into_path(*given.report)(text);
    });
    const auto outcome = parser.parse(arguments);
    if (outcome && !inputs.empty()) given.trace = inputs.front();
    return outcome;
}

std::string table(const DemandTrace& trace, const std::vector<bench::PolicyRow>& rows) {
    const auto geometry = static_cast<double>(trace.geometry_bytes());
    const auto rays = static_cast<double>(std::max<uint64_t>(1, trace.recorded.rays));
    std::string text = fmt::format("{:>8}  {:<16}{:>10} {:>11} {:>9} {:>8} {:>9} {:>9} {:>12} {:>8} {:>8}\n", "resident", "policy", "loads", "moved",
                                   "x scene", "B/ray", "rounds", "seconds", "clairvoyant", "ratio", "x least");
    for (const bench::PolicyRow& row : rows) {
        const auto bytes = static_cast<double>(row.replay.bytes_loaded);
        text += fmt::format("{:>7.1f}%  {:<16}{:>10} {:>11} {:>9.2f} {:>8.2f} {:>9} {:>9.2f} {:>12} {:>8.2f} {:>8.2f}\n",
                            100 * static_cast<double>(row.pool_bytes) / geometry, policy_name(row.policy), row.replay.loads,
                            format_bytes(row.replay.bytes_loaded), bytes / geometry, bytes / rays, row.replay.rounds, row.replay.seconds,
                            format_bytes(row.clairvoyant), bytes / static_cast<double>(std::max<uint64_t>(1, row.clairvoyant)),
                            bytes / static_cast<double>(std::max<uint64_t>(1, row.least)));
    }
    return text;
}

std::string trace_summary(const std::string& name, const DemandTrace& trace) {
    return fmt::format("{}: {} of {} paths ({:.3g} %), {} rays, {} visits; {} blocks, {}; recorded on {} with {} slots\n", name,
                       format_count(trace.path_count()), format_count(trace.recorded.paths), 100 * trace.share(), format_count(trace.rays.size()),
                       format_count(trace.visits.size()), format_count(trace.block_bytes.size()), format_bytes(trace.geometry_bytes()),
                       trace.recorded.device, format_count(trace.recorded.slots));
}

std::string check_summary(const DemandTrace& trace, const bench::ReplayCheck& check) {
    return fmt::format("check: {} with {} resident: the render moved {} in {} rounds, its replay {} in {} ({:.3f}, {:.3f})\n",
                       policy_name(trace.recorded.policy.kind), format_bytes(trace.recorded.pool_bytes), format_bytes(trace.recorded.bytes_loaded),
                       format_count(trace.recorded.rounds), format_bytes(check.replay.bytes_loaded), format_count(check.replay.rounds),
                       check.bytes_ratio, check.rounds_ratio);
}

Json replay_json(const bench::ReplayResult& replay) {
    return {{"loads", replay.loads},     {"evictions", replay.evictions}, {"bytes_loaded", replay.bytes_loaded},
            {"rounds", replay.rounds},   {"rays", replay.rays},           {"visits", replay.visits},
            {"seconds", replay.seconds}, {"stall", replay.stall},         {"longest_wait", replay.longest_wait}};
}

Json report(const PolicySettingsGiven& given, const DemandTrace& trace, const bench::ReplayCheck& check, const std::vector<bench::PolicyRow>& rows) {
    const RecordedRender& recorded = trace.recorded;
    Json list = Json::array();
    for (const bench::PolicyRow& row : rows) {
        Json entry = {{"pool_bytes", row.pool_bytes}, {"policy", policy_name(row.policy)}};
        entry.update(replay_json(row.replay));
        entry["clairvoyant_bytes"] = row.clairvoyant;
        entry["least_bytes"] = row.least;
        list.push_back(entry);
    }
    return {{"raypager", RAYPAGER_VERSION},
            {"trace", given.trace},
            {"paths", trace.path_count()},
            {"share", trace.share()},
            {"geometry_bytes", trace.geometry_bytes()},
            {"blocks", trace.block_bytes.size()},
            {"recorded",
             {{"device", recorded.device},
              {"policy", policy_name(recorded.policy.kind)},
              {"pool_bytes", recorded.pool_bytes},
              {"slots", recorded.slots},
              {"paths", recorded.paths},
              {"rays", recorded.rays},
              {"loads", recorded.loads},
              {"bytes_loaded", recorded.bytes_loaded},
              {"rounds", recorded.rounds},
              {"seconds", recorded.seconds}}},
            {"check", {{"replay", replay_json(check.replay)}, {"bytes_ratio", check.bytes_ratio}, {"rounds_ratio", check.rounds_ratio}}},
            {"rows", list}};
}

}  // namespace

Status run_bench_policy(const Arguments& arguments) {
    PolicySettingsGiven given;
    const auto outcome = parse(arguments, given);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    const auto trace = read_demand_trace(given.trace);
    if (!trace) return trace.status();
    if (trace->path_count() == 0 || trace->block_bytes.empty())
        return Status::failed(fmt::format("{}: holds no paths; record more of them with --trace-paths", given.trace));
    given.bench.policies = given.policies;
    for (const SizeOrPercent& pool : given.pools)
        given.bench.pools.push_back(pool.bytes ? pool.bytes
                                               : static_cast<uint64_t>(static_cast<double>(trace->geometry_bytes()) * pool.percent / 100));

    std::fputs(trace_summary(given.trace, *trace).c_str(), stdout);
    const bench::ReplayCheck check = bench::check_replay(*trace);
    std::fputs(check_summary(*trace, check).c_str(), stdout);
    const bool show = stderr_is_terminal();
    const auto rows = bench::bench_policies(*trace, given.bench, [show](double done) {
        if (show) progress_line(fmt::format("replaying: {:.0f} %", 100 * done));
    });
    progress_line("");
    std::fputs(table(*trace, rows).c_str(), stdout);
    return given.report ? write_text(*given.report, json_text(report(given, *trace, check, rows))) : Status();
}

}  // namespace raypager
