#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/files.hpp"
#include "base/log.hpp"
#include "bench/cluster_model.hpp"
#include "cli/bench.hpp"
#include "cli/bench_lists.hpp"
#include "cli/report.hpp"
#include "cli/values.hpp"
#include "residency/demand_trace.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* about_cluster =
    "Simulates clusters that render what a demand trace (render --record-trace) was recorded of, without a device: the store lies in the\n"
    "nodes' memory, and they send blocks to each other. Says how long that takes beside one node with everything resident, and what crosses\n"
    "the links. bench/README.md says what is modelled, and what to record.";

struct ClusterSettingsGiven {
    std::string trace;
    std::vector<uint32_t> nodes = {8, 16, 32, 64};
    std::vector<double> links = {bench::ClusterSettings().link};
    SizeOrPercent pool = {0, 3}, host = {0, 25};
    uint64_t samples = 0, repeats = 0, film_bytes = 0;
    uint64_t store_bytes = 0;  // 0: the trace's
    uint64_t bandwidth = 0, ray_rate = 0, disk = 0;
    uint32_t slots = 0;
    double latency = bench::ClusterSettings().latency, round_seconds = 0;
    std::optional<std::filesystem::path> report;

    double enlargement(const DemandTrace& of) const {
        return store_bytes ? static_cast<double>(store_bytes) / static_cast<double>(of.geometry_bytes()) : 1;
    }
    // In bytes of the trace's store.
    uint64_t bytes_of(const SizeOrPercent& size, const DemandTrace& of) const {
        const double bytes =
            size.bytes ? static_cast<double>(size.bytes) / enlargement(of) : static_cast<double>(of.geometry_bytes()) * size.percent / 100;
        return static_cast<uint64_t>(bytes);
    }
};

struct ClusterTable {
    struct Row {
        uint32_t nodes = 0;
        double link = 0;
        bench::ClusterResult result;
        // Against this run of one node.
        double efficiency(const bench::ClusterResult& one) const { return one.seconds / nodes / result.seconds; }
    };
    uint64_t store_bytes = 0;
    bench::ClusterResult resident, paging;  // one node with all in its memory: on the device, too, or in a pool as the others have
    std::vector<Row> rows;
};

void add_model_options(OptionParser& parser, ClusterSettingsGiven& given) {
    parser.option("bandwidth", "SIZE", "bytes per second to each device (default: no limit)", into(given.bandwidth, parse_size));
    parser.option("ray-rate", "N", "rays per second of a device with everything resident (default: as recorded)",
                  into(given.ray_rate, [](const std::string& text) { return parse_count(text, 1, uint64_t{1} << 50); }));
    parser.option("round-time", "SECONDS", "what a round takes beside its rays (default: nothing)", into(given.round_seconds, parse_seconds));
    parser.option("latency", "SECONDS", "from a request to the first byte (default: 0.00002)", into(given.latency, parse_seconds));
    parser.option("disk", "SIZE", "bytes per second of each node's disk (default: 3e9)", into(given.disk, parse_size));
    parser.option("film", "SIZE", "bytes of a film, which are added up in the end (default: none)", into(given.film_bytes, parse_size));
}

Result<OptionParser::Outcome> parse(const Arguments& arguments, ClusterSettingsGiven& given) {
    std::vector<std::string> inputs;
    OptionParser parser("bench cluster", "TRACE [options]", about_cluster);
    parser.inputs("the demand trace", 1, 1, inputs);
    parser.option("nodes", "LIST", "how many (default: 8,16,32,64)", into_list(given.nodes, [](const std::string& text) -> Result<uint32_t> {
                      const auto count = parse_count(text, 1, max_cluster_nodes);
                      return count ? Result<uint32_t>(static_cast<uint32_t>(*count)) : count.status();
                  }));
    parser.option("links", "LIST", "bytes per second of a node's link, each way (default: 12.5e9)",
                  into_list(given.links, [](const std::string& text) -> Result<double> {
                      const auto size = parse_size(text);
                      return size ? Result<double>(static_cast<double>(*size)) : size.status();
                  }));
    parser.option("pool", "SIZE", "on each device, in bytes or as a share of the store (default: 3%)", into(given.pool, parse_size_or_percent));
    parser.option("host-limit", "SIZE", "of each node, in bytes or as a share of the store (default: 25%)", into(given.host, parse_size_or_percent));
    parser.option("paths", "N", "path slots of each device (default: as recorded)", into_count(given.slots, 1, 1 << 30));
    parser.option("samples", "N", "samples of the whole picture (default: as recorded)",
                  into(given.samples, [](const std::string& text) { return parse_count(text, 1, uint64_t{1} << 50); }));
    parser.option("store", "SIZE", "as if the store were so large, of as many more blocks (default: as recorded)",
                  into(given.store_bytes, parse_size));
    parser.option("repeats", "N", "how often each path of the trace is traced (default: enough for some slots a block)",
                  into(given.repeats, [](const std::string& text) { return parse_count(text, 1, 1 << 20); }));
    add_model_options(parser, given);
    parser.option("report", "FILE.json", "every figure, for scripts", [&given](const std::string& text) {
        given.report.emplace();
        return into_path(*given.report)(text);
    });
    const auto outcome = parser.parse(arguments);
    if (outcome && !inputs.empty()) given.trace = inputs.front();
    return outcome;
}

// What all runs have in common, with a pool for a part of the store.
bench::ClusterSettings settings_within(const DemandTrace& trace, const ClusterSettingsGiven& given, uint64_t pool_bytes) {
    bench::ClusterSettings settings;
    const RecordedRender& recorded = trace.recorded;
    settings.render_paths = given.samples ? given.samples : recorded.paths;
    settings.node = bench::recorded_settings(trace);
    settings.node.slots = given.slots ? given.slots : recorded.slots;
    settings.node.slab_bytes = 0;
    settings.node.wait_for_loads = false;
    const DeviceProfile profile = profile_of_cores(recorded.cpu_cores);
    settings.node.rounds_under_way = profile.rounds_under_way;
    settings.node.pool_bytes = std::max<uint64_t>(pool_bytes, trace.largest_block());
    settings.node.policy =
        default_settings(recorded.policy.kind, settings.node.pool_bytes, trace.geometry_bytes() / trace.block_bytes.size(), profile);
    settings.node.round_seconds = given.round_seconds;
    settings.node.bandwidth = static_cast<double>(given.bandwidth);
    const auto work = static_cast<double>(trace.visits.size() + trace.rays.size()), rays = static_cast<double>(trace.rays.size());
    if (given.ray_rate) settings.node.visit_seconds = rays / work / static_cast<double>(given.ray_rate);
    settings.latency = given.latency;
    settings.film_bytes = given.film_bytes;
    if (given.store_bytes) settings = shrunk(settings, 1 / given.enlargement(trace));
    settings.repeats = given.repeats ? given.repeats : bench::suitable_repeats(trace, settings.render_paths, settings.node.slots);
    settings.together = bench::paths_of_region(trace, settings.render_paths, settings.node.slots);
    if (given.disk) settings.disk = static_cast<double>(given.disk);
    return settings;
}

// One node with everything in its memory.
bench::ClusterSettings alone(const DemandTrace& trace, bench::ClusterSettings settings) {
    settings.nodes = 1;
    settings.host_bytes = 2 * trace.geometry_bytes();
    settings.film_bytes = 0;
    return settings;
}

std::string summary(const ClusterSettingsGiven& given, const DemandTrace& trace, const bench::ClusterSettings& settings, const ClusterTable& table) {
    return fmt::format(
        "{}: a store of {}; {} of the samples are replayed, with {} slots and {} blocks\n"
        "one node with all in its memory takes {} with all of it on the device, {} with {}\n",
        given.trace, format_bytes(table.store_bytes), format_share(settings.share_of(trace) / given.enlargement(trace)),
        format_count(static_cast<uint64_t>(settings.node.slots * settings.share_of(trace))), format_count(trace.block_bytes.size()),
        format_duration(table.resident.seconds), format_duration(table.paging.seconds),
        format_share(static_cast<double>(settings.node.pool_bytes) / static_cast<double>(trace.geometry_bytes())));
}

std::string text_of(const ClusterTable& table) {
    const auto share = [&](uint64_t bytes) { return format_share(static_cast<double>(bytes) / static_cast<double>(table.store_bytes)); };
    std::string text = fmt::format("{:>6} {:>12} {:>9} {:>10} {:>9} {:>13} {:>13} {:>8} {:>8}  {}\n", "nodes", "link", "time", "efficiency",
                                   "of paging", "link in", "link out", "shard", "cache", "bound by");
    for (const ClusterTable::Row& row : table.rows) {
        const bench::ClusterResult& r = row.result;
        const auto rate = [](double bytes) { return format_bytes(static_cast<uint64_t>(bytes)) + "/s"; };
        text += fmt::format("{:>6} {:>12} {:>9} {:>10.3f} {:>9.3f} {:>13} {:>13} {:>8} {:>8}  {}\n", row.nodes, rate(row.link),
                            format_duration(r.seconds), row.efficiency(table.resident), row.efficiency(table.paging),
                            rate(static_cast<double>(r.most_received) / r.seconds), rate(static_cast<double>(r.most_sent) / r.seconds),
                            share(r.shard_bytes), share(r.cached_bytes), bound_name(r.bound()));
    }
    return text;
}

Json result_json(const bench::ClusterResult& r) {
    return {{"seconds", r.seconds},
            {"tracing_seconds", r.tracing},
            {"film_seconds", r.film_seconds},
            {"bus_seconds", r.bus},
            {"link_in_seconds", r.link_in},
            {"link_out_seconds", r.link_out},
            {"disk_seconds", r.disk},
            {"loads", r.loads},
            {"bytes_loaded", r.bytes_loaded},
            {"bytes_from_cache", r.from_cache},
            {"bytes_from_own_shard", r.from_own_shard},
            {"bytes_from_disk", r.from_disk},
            {"bytes_received", r.received},
            {"most_received_by_a_node", r.most_received},
            {"most_sent_by_a_node", r.most_sent},
            {"rays", r.rays},
            {"rounds", r.rounds},
            {"shard_bytes", r.shard_bytes},
            {"store_in_memory_bytes", r.store_in_memory},
            {"cached_bytes", r.cached_bytes},
            {"bound", bound_name(r.bound())}};
}

Json json_of(const ClusterSettingsGiven& given, const DemandTrace& trace, const bench::ClusterSettings& settings, const ClusterTable& table) {
    Json rows = Json::array();
    for (const ClusterTable::Row& row : table.rows) {
        Json entry = {{"nodes", row.nodes},
                      {"link_bytes_per_second", row.link},
                      {"efficiency", row.efficiency(table.resident)},
                      {"efficiency_of_paging", row.efficiency(table.paging)}};
        entry.update(result_json(row.result));
        rows.push_back(entry);
    }
    return {{"raypager", RAYPAGER_VERSION},
            {"trace", given.trace},
            {"store_bytes", table.store_bytes},
            {"blocks", trace.block_bytes.size()},
            {"samples", given.samples ? given.samples : trace.recorded.paths},
            {"replayed_share", settings.share_of(trace) / given.enlargement(trace)},
            {"replayed_slots", settings.node.slots * settings.share_of(trace)},
            {"one_node_resident", result_json(table.resident)},
            {"one_node_paging", result_json(table.paging)},
            {"rows", rows}};
}

}  // namespace

Status run_bench_cluster(const Arguments& arguments) {
    ClusterSettingsGiven given;
    const auto outcome = parse(arguments, given);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    const auto trace = read_demand_trace(given.trace);
    if (!trace) return trace.status();
    if (trace->path_count() == 0 || trace->block_bytes.empty() || trace->rays.empty())
        return Status::failed(fmt::format("{}: holds no paths; record more of them with --trace-paths", given.trace));
    const double enlargement = given.enlargement(*trace);
    const auto simulate = [&](const bench::ClusterSettings& settings) { return enlarged(simulate_cluster(*trace, settings), enlargement); };
    const uint64_t pool = given.bytes_of(given.pool, *trace), small_store = trace->geometry_bytes();
    bench::ClusterSettings settings = settings_within(*trace, given, pool);
    ClusterTable table;
    table.store_bytes = given.store_bytes ? given.store_bytes : small_store;
    table.resident = simulate(alone(*trace, settings_within(*trace, given, small_store)));
    table.paging = simulate(alone(*trace, settings));
    settings.host_bytes = given.bytes_of(given.host, *trace);
    for (const double link : given.links)
        for (const uint32_t nodes : given.nodes) {
            settings.link = link, settings.nodes = nodes;
            if (bench::simulation_bytes(*trace, settings) > bench::most_simulation_bytes)
                return Status::usage(fmt::format("--nodes: {} of them with so many blocks take more memory to simulate than there is for it", nodes));
            if (stderr_is_terminal()) progress_line(fmt::format("simulating {} nodes", nodes));
            table.rows.push_back({nodes, link, simulate(settings)});
        }
    progress_line("");
    std::fputs(summary(given, *trace, settings, table).c_str(), stdout);
    std::fputs(text_of(table).c_str(), stdout);
    return given.report ? write_text(*given.report, json_text(json_of(given, *trace, settings, table))) : Status();
}

}  // namespace raypager
