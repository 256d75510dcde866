#include "bench/sweep_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "base/words.hpp"

namespace raypager::bench {
namespace {

std::vector<const SweepRun*> runs_of(const SweepResult& result, size_t variant) {
    std::vector<const SweepRun*> runs;
    for (const SweepRun& run : result.runs)
        if (run.variant == variant) runs.push_back(&run);
    return runs;
}

template <class Value>
double median_of(const std::vector<const SweepRun*>& runs, const Value& value) {
    std::vector<double> values;
    for (const SweepRun* run : runs) values.push_back(value(*run));
    return median(std::move(values));
}

double ratio(double a, double b) { return b > 0 ? a / b : 0; }

double resident_percent(const SweepResult& result, const SweepRun& run) {
    const auto pool = static_cast<double>(std::min(run.report.limits.geometry_bytes, result.geometry_bytes));
    return result.geometry_bytes ? 100 * pool / static_cast<double>(result.geometry_bytes) : 100;
}

// The variant with the same settings and the most memory.
size_t roomiest(const SweepResult& result, size_t variant) {
    size_t best = variant;
    for (size_t i = 0; i < result.variants.size(); i++) {
        if (result.variants[i].settings_name() != result.variants[variant].settings_name()) continue;
        if (resident_percent(result, *runs_of(result, i).front()) > resident_percent(result, *runs_of(result, best).front())) best = i;
    }
    return best;
}

std::string csv_settings(const SweepVariant& v) {
    return fmt::format("{},{},{},{}", v.limit_name(), v.policy.name(), v.paths.name(), v.connection == Connection::queue ? "queue" : "roulette");
}

}  // namespace

double median(std::vector<double> values) {
    RAYPAGER_CHECK(!values.empty());
    std::sort(values.begin(), values.end());
    const size_t middle = values.size() / 2;
    return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

std::optional<double> seconds_to(const std::vector<ConvergencePoint>& convergence, double rmse) {
    for (size_t i = 0; i < convergence.size(); i++) {
        const ConvergencePoint& point = convergence[i];
        if (point.rmse > rmse) continue;
        if (i == 0 || point.rmse <= 0 || convergence[i - 1].seconds <= 0) return point.seconds;
        const ConvergencePoint& before = convergence[i - 1];
        const double part = std::log(before.rmse / rmse) / std::log(before.rmse / point.rmse);
        return before.seconds * std::pow(point.seconds / before.seconds, part);
    }
    return std::nullopt;
}

double common_rmse(const SweepResult& result) {
    double worst = 0;
    for (const SweepRun& run : result.runs) worst = std::max(worst, run.convergence.back().rmse);
    return 1.05 * worst;  // the last samples, when few rays are left, are not what is to be compared
}

std::vector<VariantFigures> variant_figures(const SweepResult& result) {
    const double target = common_rmse(result);
    std::vector<VariantFigures> figures;
    for (size_t variant = 0; variant < result.variants.size(); variant++) {
        const auto runs = runs_of(result, variant), roomy = runs_of(result, roomiest(result, variant));
        VariantFigures f;
        f.seconds = median_of(runs, [](const SweepRun& r) { return r.seconds; });
        f.stall_share = median_of(runs, [](const SweepRun& r) { return ratio(r.report.seconds.stall, r.seconds); });
        f.rays_per_second = median_of(runs, [](const SweepRun& r) { return ratio(double(r.report.rays.total()), r.seconds); });
        f.bytes_loaded = median_of(runs, [](const SweepRun& r) { return double(r.report.paging.bytes_loaded); });
        f.bytes_per_ray =
            median_of(runs, [](const SweepRun& r) { return ratio(double(r.report.paging.bytes_loaded), double(r.report.rays.total())); });
        f.loads = median_of(runs, [](const SweepRun& r) { return double(r.report.paging.loads); });
        f.rounds = median_of(runs, [](const SweepRun& r) { return double(r.report.paging.rounds); });
        f.rmse = runs.front()->convergence.back().rmse;
        f.resident_percent = resident_percent(result, *runs.front());
        std::vector<double> ratios, arrivals;
        for (size_t i = 0; i < runs.size(); i++) {
            ratios.push_back(ratio(runs[i]->seconds, roomy[i]->seconds));
            if (const auto seconds = seconds_to(runs[i]->convergence, target)) arrivals.push_back(*seconds);
        }
        f.slow_down = median(std::move(ratios));
        if (arrivals.size() == runs.size()) f.seconds_to_rmse = median(std::move(arrivals));
        figures.push_back(f);
    }
    return figures;
}

std::string runs_csv(const SweepResult& result) {
    std::string text =
        "limit,policy,paths,connection,repeat,resident_percent,pool_bytes,path_slots,spp,seconds,trace_seconds,stall_seconds,rmse,seconds_to_rmse,"
        "rays,rays_per_second,rounds,loads,evictions,bytes_loaded,bytes_per_ray,peak_memory_bytes,film_hash\n";
    const double target = common_rmse(result);
    for (const SweepRun& run : result.runs) {
        const RenderReport& r = run.report;
        const auto rays = static_cast<double>(r.rays.total());
        const auto reached = seconds_to(run.convergence, target);
        text += fmt::format("{},{},{:.4f},{},{},{},{:.6f},{:.6f},{:.6f},{:.8g},{},{},{:.0f},{},{},{},{},{:.6g},{},{}\n",
                            csv_settings(result.variants[run.variant]), run.repeat + 1, resident_percent(result, run), r.limits.geometry_bytes,
                            r.paths, r.spp, run.seconds, r.seconds.trace, r.seconds.stall, run.convergence.back().rmse,
                            reached ? fmt::format("{:.6f}", *reached) : "", r.rays.total(), ratio(rays, run.seconds), r.paging.rounds, r.paging.loads,
                            r.paging.evictions, r.paging.bytes_loaded, ratio(double(r.paging.bytes_loaded), rays), r.peak.memory_bytes,
                            hex64(r.film_hash));
    }
    return text;
}

std::string convergence_csv(const SweepResult& result) {
    std::string text = "limit,policy,paths,connection,repeat,seconds,spp,rmse,bytes_loaded\n";
    for (const SweepRun& run : result.runs)
        for (const ConvergencePoint& point : run.convergence)
            text += fmt::format("{},{},{:.6f},{:.4f},{:.8g},{}\n", csv_settings(result.variants[run.variant]), run.repeat + 1, point.seconds,
                                point.spp, point.rmse, point.bytes_loaded);
    return text;
}

std::string residency_csv(const SweepResult& result) {
    std::string text = "run,round,seconds,block,came\n";
    for (size_t i = 0; i < result.runs.size(); i++) {
        const SweepRun& run = result.runs[i];
        if (run.round_seconds.empty()) continue;
        for (const PagingEvent& event : run.journal) {
            const float seconds = run.round_seconds[std::min<size_t>(event.round - 1, run.round_seconds.size() - 1)];
            fmt::format_to(std::back_inserter(text), "{},{},{:.6f},{},{}\n", i, event.round, seconds, event.block, event.came ? 1 : 0);
        }
    }
    return text;
}

std::string sweep_table(const SweepResult& result) {
    const auto figures = variant_figures(result);
    size_t widest = 8;
    for (const SweepVariant& v : result.variants) widest = std::max(widest, v.settings_name().size());
    std::string text = fmt::format("{:>9}  {:<{}} {:>9} {:>8} {:>7} {:>9} {:>11} {:>8} {:>8} {:>10} {:>10}\n", "resident", "settings", widest,
                                   "seconds", "x roomy", "stall", "Mrays/s", "moved", "x scene", "B/ray", "rmse", "s to rmse");
    for (size_t i = 0; i < figures.size(); i++) {
        const VariantFigures& f = figures[i];
        text += fmt::format("{:>9}  {:<{}} {:>9.3f} {:>8.3f} {:>6.1f}% {:>9.2f} {:>11} {:>8.2f} {:>8.2f} {:>10.4g} {:>10}\n",
                            result.variants[i].limit_name(), result.variants[i].settings_name(), widest, f.seconds, f.slow_down, 100 * f.stall_share,
                            f.rays_per_second * 1e-6, format_bytes(static_cast<uint64_t>(f.bytes_loaded)),
                            ratio(f.bytes_loaded, double(result.geometry_bytes)), f.bytes_per_ray, f.rmse,
                            f.seconds_to_rmse ? fmt::format("{:.3f}", *f.seconds_to_rmse) : "-");
    }
    return text;
}

}  // namespace raypager::bench
