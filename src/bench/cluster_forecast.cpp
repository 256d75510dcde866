#include "raypager/cluster_forecast.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/words.hpp"
#include "bench/cluster_model.hpp"
#include "bench/forecast_runs.hpp"
#include "film/film_layout.hpp"
#include "render/render.hpp"
#include "store/block_source.hpp"
#include "store/shards.hpp"

namespace raypager {
namespace {

using namespace bench;

// All paths of a few samples of each pixel, or of one sample of some pixels of a large picture.
constexpr uint64_t recorded_paths = 500000;

class ClusterForecaster {
public:
    ClusterForecaster(const Blocks& scene, const RenderOptions& options, const Forecast& measured, const ClusterForecastOptions& how,
                      const RenderCallbacks& callbacks)
        : source_(scene.source()), options_(options), measured_(measured), how_(how), callbacks_(callbacks) {
        options_.width = measured.width, options_.height = measured.height, options_.spp = measured.spp;
        if (how.stop) options_.stop_now = how.stop;
    }

    Result<ClusterForecast> run() {
        report(0);
        auto trace = record();
        if (stopped()) return interrupted();
        if (!trace) return trace.status();
        trace_ = std::move(*trace);
        if (trace_.rays.empty()) return Status::failed("--nodes: the paths that were recorded hold no rays; give a larger --size");
        const auto rate = upload_rate(options_);
        if (!rate) return rate.status();
        forecast_.upload_rate = *rate;
        forecast_.store_bytes = trace_.geometry_bytes();
        forecast_.recorded_paths = trace_.path_count();
        RAYPAGER_TRY(simulate());
        return std::move(forecast_);
    }

private:
    bool stopped() const { return how_.stop && *how_.stop; }
    static Status interrupted() { return Status::interrupted("stopped before the forecast was complete"); }
    void report(double fraction) const {
        if (how_.progress) how_.progress(fraction);
    }
    uint64_t samples() const { return pixels() * options_.spp; }
    uint64_t pixels() const { return uint64_t{options_.width} * options_.height; }

    // With all samples of a pixel side by side, so that a region of any size is a row of paths. Everything resident, if there is memory for it: then
    // every block that stops a shadow ray is known.
    Result<DemandTrace> record() const {
        RenderOptions options = options_;
        options.spp = static_cast<uint32_t>(std::clamp<uint64_t>((recorded_paths + pixels() - 1) / std::max<uint64_t>(1, pixels()), 1, options_.spp));
        options.tuning.together = std::min(options.spp, 64u);
        options.tuning.region = 0;
        options.progress_seconds = 1e9;
        RenderInstruments instruments;
        instruments.record_paths = recorded_paths;
        RenderCallbacks own;
        own.warning = callbacks_.warning;
        RenderOptions resident = options;
        resident.geometry_limit = 0, resident.geometry_limit_percent = 0;
        resident.tuning.pool_place = PoolPlace::host;
        auto result = render(source_, resident, own, instruments);
        if (!result && !stopped()) result = render(source_, options, own, instruments);
        if (!result) return result.status();
        if (!result->trace) return interrupted();
        return std::move(*result->trace);
    }

    // Of the resident render's seconds, a visit's share.
    double visit_seconds() const {
        ReplaySettings all;
        all.policy = default_settings(PolicyKind::lru);
        all.pool_bytes = trace_.geometry_bytes();
        all.slots = 4096;
        const auto visits = static_cast<double>(std::max<uint64_t>(1, replay(trace_, all).visits));
        return measured_.resident.seconds / visits * static_cast<double>(trace_.path_count()) / static_cast<double>(samples());
    }

    Result<ClusterSettings> settings_of(uint32_t nodes, double visit_seconds) const {
        const auto plan = plan_within(source_, options_, nodes);
        if (!plan) return plan.status();
        ClusterSettings settings;
        settings.nodes = nodes;
        settings.node.policy = plan->policy;
        // Blocks are in their stored form here, which a device may hold in another.
        const double share = std::min(1.0, static_cast<double>(plan->pool_bytes) / static_cast<double>(std::max<uint64_t>(1, plan->scene_bytes)));
        settings.node.pool_bytes =
            std::max<uint64_t>(trace_.largest_block(), static_cast<uint64_t>(share * static_cast<double>(trace_.geometry_bytes())));
        settings.node.slots = plan->slots;
        settings.node.visit_seconds = visit_seconds;
        settings.node.rounds_under_way = plan->rounds_under_way;
        settings.node.bandwidth = forecast_.upload_rate;
        settings.render_paths = samples();
        settings.repeats = suitable_repeats(trace_, samples(), plan->slots);
        settings.together = plan->region_pixels * trace_.path_count() / pixels();
        settings.host_bytes = plan->host_bytes;
        settings.link = how_.link;
        settings.film_bytes = pixels() * FilmLayout(options_.layers).words() * sizeof(uint32_t);
        settings.stop = how_.stop;
        if (simulation_bytes(trace_, settings) > most_simulation_bytes)
            return Status::usage(fmt::format("--nodes: a simulation of {} nodes with {} blocks each takes {}; give fewer", format_count(nodes),
                                             format_count(trace_.block_bytes.size()), format_bytes(simulation_bytes(trace_, settings))));
        return settings;
    }

    ClusterForecastRow row_of(const ClusterSettings& settings, const ClusterResult& result) const {
        ClusterForecastRow row;
        row.nodes = settings.nodes;
        row.seconds = result.seconds, row.tracing_seconds = result.tracing, row.film_seconds = result.film_seconds;
        row.efficiency = result.seconds > 0 ? forecast_.resident_seconds / settings.nodes / result.seconds : 1;
        row.bound = bound_name(result.bound());
        const auto rate = [&result](uint64_t bytes) { return result.seconds > 0 ? static_cast<double>(bytes) / result.seconds : 0; };
        row.link_in = rate(result.most_received), row.link_out = rate(result.most_sent);
        row.bytes_loaded = result.bytes_loaded, row.bytes_from_cache = result.from_cache, row.bytes_from_own_shard = result.from_own_shard;
        row.bytes_received = result.received, row.bytes_from_disk = result.from_disk;
        row.host_limit = settings.host_bytes, row.shard_bytes = result.shard_bytes, row.cached_bytes = result.cached_bytes;
        row.store_in_memory = result.store_in_memory;
        row.whole_store_host_limit = host_bytes_for_shard(forecast_.store_bytes / settings.nodes + 1);
        return row;
    }

    // With which one node within the limits takes as long as was measured: where rays wait for blocks, devices take longer for each than the model
    // says, for fewer run together, and some in vain.
    Result<double> visit_seconds_within(double resident) const {
        auto one = settings_of(1, resident);
        if (!one) return one.status();
        one->film_bytes = 0;
        constexpr int steps = 3;  // what a step changes is small after the first
        for (int i = 0; i < steps && !stopped(); i++) {
            const ClusterResult result = simulate_cluster(trace_, *one);
            const double missing = measured_.asked.seconds - result.seconds;
            if (!(result.tracing > 0)) break;
            one->node.visit_seconds = std::max(resident, one->node.visit_seconds * (1 + missing / result.tracing));
        }
        return one->node.visit_seconds;
    }

    Status simulate() {
        const double resident_visit = visit_seconds();
        auto resident = settings_of(1, resident_visit);
        if (!resident) return resident.status();
        resident->node.pool_bytes = trace_.geometry_bytes();
        resident->host_bytes = 2 * trace_.geometry_bytes();
        resident->film_bytes = 0;
        forecast_.resident_seconds = simulate_cluster(trace_, *resident).seconds;
        const auto visit = visit_seconds_within(resident_visit);
        if (!visit) return visit.status();
        forecast_.paging_cost = resident_visit > 0 ? *visit / resident_visit : 1;
        std::vector<uint32_t> counts = {1};
        std::ranges::copy_if(how_.nodes, std::back_inserter(counts), [](uint32_t nodes) { return nodes > 1; });
        for (const uint32_t nodes : counts) {
            report(0.5 + 0.5 * static_cast<double>(forecast_.rows.size()) / static_cast<double>(counts.size()));
            const auto settings = settings_of(nodes, *visit);
            if (!settings) return settings.status();
            const ClusterResult result = simulate_cluster(trace_, *settings);
            if (stopped()) return interrupted();
            forecast_.rows.push_back(row_of(*settings, result));
        }
        report(1);
        return {};
    }

    const BlockSource& source_;
    RenderOptions options_;
    const Forecast& measured_;
    const ClusterForecastOptions& how_;
    const RenderCallbacks& callbacks_;
    DemandTrace trace_;
    ClusterForecast forecast_;
};

}  // namespace

Status check_cluster_forecast(const Blocks& scene) {
    if (scene.source().scene().instances > 0)
        return Status::usage(
            "--nodes: it takes a record of which blocks rays enter, and rays of a scene with instances cannot be recorded; plan without it");
    return {};
}

Result<ClusterForecast> forecast_cluster(const Blocks& scene, const RenderOptions& options, const Forecast& measured,
                                         const ClusterForecastOptions& how, const RenderCallbacks& callbacks) {
    RAYPAGER_TRY(check_cluster_forecast(scene));
    const auto possible = [](uint32_t nodes) { return nodes > 0 && nodes <= max_cluster_nodes; };
    if (!std::ranges::all_of(how.nodes, possible)) return Status::usage(fmt::format("--nodes: give from 1 to {} of them", max_cluster_nodes));
    if (!(how.link > 0)) return Status::usage("--link: give more than 0 bytes per second");
    return ClusterForecaster(scene, options, measured, how, callbacks).run();
}

}  // namespace raypager
