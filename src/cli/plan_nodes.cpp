#include "cli/plan_nodes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/bench_lists.hpp"
#include "cli/values.hpp"

namespace raypager {
namespace {

using Json = nlohmann::ordered_json;

std::string rate_text(double bytes_per_second) { return format_bytes(static_cast<uint64_t>(bytes_per_second)) + "/s"; }

double of_store(const ClusterForecast& forecast, uint64_t bytes) {
    return static_cast<double>(bytes) / static_cast<double>(std::max<uint64_t>(1, forecast.store_bytes));
}

}  // namespace

void add_node_options(OptionParser& parser, PlanNodes& nodes) {
    parser.option("nodes", "LIST", "also for so many machines like this one under mpirun (8,16,32)",
                  into_list(nodes.how.nodes, [](const std::string& text) -> Result<uint32_t> {
                      const auto count = parse_count(text, 1, max_cluster_nodes);
                      return count ? Result<uint32_t>(static_cast<uint32_t>(*count)) : count.status();
                  }));
    parser.option("link", "SIZE", "bytes per second of each one's link, each way (default: 12.5e9)", [&nodes](const std::string& text) {
        const auto size = parse_size(text);
        if (!size) return size.status();
        nodes.link_given = true;
        nodes.how.link = static_cast<double>(*size);
        return Status();
    });
}

Status check_node_options(const OptionParser& parser, const PlanNodes& nodes) {
    if (nodes.link_given && nodes.how.nodes.empty()) return parser.wrong("--link: is for a plan of several machines; say how many with --nodes");
    return {};
}

std::string nodes_text(const ClusterForecast& forecast, double link) {
    std::string text = fmt::format("machines with a link of {} each, by a simulation of {} recorded paths:\n", rate_text(link),
                                   format_count(forecast.recorded_paths));
    text += fmt::format("  {:>5} {:>10} {:>10} {:>13} {:>13} {:>8} {:>8}  {}\n", "nodes", "time", "efficiency", "link in", "link out", "shard",
                        "cache", "bound by");
    for (const ClusterForecastRow& row : forecast.rows) {
        text += fmt::format("  {:>5} {:>10} {:>10} {:>13} {:>13} {:>8} {:>8}  {}\n", row.nodes, format_duration(row.seconds),
                            format_share(row.efficiency), rate_text(row.link_in), rate_text(row.link_out),
                            format_share(of_store(forecast, row.shard_bytes)), format_share(of_store(forecast, row.cached_bytes)), row.bound);
    }
    text += fmt::format("  as measured: within these limits rays take {:.2f} times as long as with everything resident, waits aside; uploads {}\n",
                        forecast.paging_cost, rate_text(forecast.upload_rate));
    for (const ClusterForecastRow& row : forecast.rows)
        if (row.nodes > 1 && row.store_in_memory < forecast.store_bytes)
            text += fmt::format("  {} of the store stays on the disks of {} nodes: all of it takes --host-limit {}M\n",
                                format_share(1 - of_store(forecast, row.store_in_memory)), row.nodes, (row.whole_store_host_limit >> 20) + 1);
    return text;
}

Json nodes_json(const ClusterForecast& forecast, double link) {
    Json rows = Json::array();
    for (const ClusterForecastRow& row : forecast.rows) {
        rows.push_back({{"nodes", row.nodes},
                        {"seconds", row.seconds},
                        {"efficiency", row.efficiency},
                        {"link_in_bytes_per_second", row.link_in},
                        {"link_out_bytes_per_second", row.link_out},
                        {"bytes_loaded", row.bytes_loaded},
                        {"bytes_received", row.bytes_received},
                        {"bytes_from_cache", row.bytes_from_cache},
                        {"bytes_from_own_shard", row.bytes_from_own_shard},
                        {"bytes_from_disk", row.bytes_from_disk},
                        {"host_limit", row.host_limit},
                        {"shard_bytes", row.shard_bytes},
                        {"cached_bytes", row.cached_bytes},
                        {"store_in_memory_bytes", row.store_in_memory},
                        {"tracing_seconds", row.tracing_seconds},
                        {"film_seconds", row.film_seconds},
                        {"bound", row.bound}});
    }
    return {{"link_bytes_per_second", link},
            {"store_bytes", forecast.store_bytes},
            {"recorded_paths", forecast.recorded_paths},
            {"resident_seconds", forecast.resident_seconds},
            {"paging_cost", forecast.paging_cost},
            {"upload_bytes_per_second", forecast.upload_rate},
            {"rows", rows}};
}

}  // namespace raypager
