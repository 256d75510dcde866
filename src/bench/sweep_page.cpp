#include "bench/sweep_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/hash.hpp"
#include "bench/residency_raster.hpp"
#include "bench/svg_plot.hpp"
#include "bench/sweep_figures.hpp"

namespace raypager::bench {
namespace {

constexpr size_t most_timelines = 16;

constexpr const char* style = R"css(
body{font:15px/1.45 system-ui,sans-serif;color:#111;background:#fff;max-width:60em;margin:2em auto;padding:0 1em}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #999}
table{border-collapse:collapse;font-size:.85em;width:100%}th,td{padding:.2em .5em;text-align:right;border-bottom:1px solid #ddd}
th{border-bottom:1px solid #111}td.l,th.l{text-align:left}code{font-size:.9em;overflow-wrap:anywhere}
figure{margin:1em 0;break-inside:avoid}figcaption{font-size:.9em}svg{width:100%;height:auto}
svg text{font:12px system-ui,sans-serif;fill:#111}svg .label{font-size:13px}.grid{stroke:#ddd;fill:none}.axis{stroke:#111;fill:none}
.good{color:#006b4f}.bad{color:#b00020;font-weight:bold}
@media print{body{margin:0;max-width:none;font-size:10pt}h2{break-after:avoid}@page{margin:15mm}}
)css";

std::string figure(const std::string& svg, const std::string& caption) {
    return "<figure>" + svg + "<figcaption>" + escape_markup(caption) + "</figcaption></figure>\n";
}

// The different settings of a sweep, limits aside, in order.
std::vector<std::string> settings_names(const SweepResult& result) {
    std::vector<std::string> names;
    for (const SweepVariant& v : result.variants)
        if (std::find(names.begin(), names.end(), v.settings_name()) == names.end()) names.push_back(v.settings_name());
    return names;
}

// The paper's Figure 7 for one of the settings: a curve a limit.
std::string convergence_plot(const SweepResult& result, const std::string& settings) {
    Plot plot;
    plot.x_label = "seconds of rendering";
    plot.y_label = "RMSE against the reference";
    plot.log_x = plot.log_y = true;
    for (const SweepRun& run : result.runs) {
        const SweepVariant& v = result.variants[run.variant];
        if (run.repeat != 0 || v.settings_name() != settings) continue;
        PlotSeries series;
        series.name = v.policy.baseline == SweepPolicy::Baseline::host ? "all geometry in mapped host memory" : v.limit_name() + " resident";
        series.style = static_cast<int>(plot.series.size());
        for (const ConvergencePoint& point : run.convergence) series.points.emplace_back(point.seconds, point.rmse);
        plot.series.push_back(std::move(series));
    }
    return svg_plot(plot);
}

struct Quantity {
    const char *label, *caption;
    bool log_y, from_zero;
    std::function<double(const VariantFigures&)> median;
    std::function<double(const SweepRun&)> single;
};

// A quantity against the limit: a line a setting through the medians, and every single run.
std::string limit_plot(const SweepResult& result, const std::vector<VariantFigures>& figures, const Quantity& quantity) {
    Plot plot;
    plot.x_label = "resident geometry, % of the scene";
    plot.y_label = quantity.label;
    plot.log_x = true;
    plot.log_y = quantity.log_y;
    plot.y_from_zero = quantity.from_zero;
    for (const std::string& name : settings_names(result)) {
        PlotSeries series;
        series.name = name;
        series.style = static_cast<int>(plot.series.size());
        for (size_t i = 0; i < figures.size(); i++)
            if (result.variants[i].settings_name() == name) series.points.emplace_back(figures[i].resident_percent, quantity.median(figures[i]));
        for (const SweepRun& run : result.runs)
            if (result.variants[run.variant].settings_name() == name)
                series.loose.emplace_back(figures[run.variant].resident_percent, quantity.single(run));
        std::sort(series.points.begin(), series.points.end());
        plot.series.push_back(std::move(series));
    }
    return svg_plot(plot);
}

std::string limit_plots(const SweepResult& result, const std::vector<VariantFigures>& figures) {
    const double mebi = 1.0 / 1048576;
    const Quantity quantities[] = {
        {"seconds of rendering", "Time against the limit. Lines: medians; pale marks: single runs.", true, false,
         [](const VariantFigures& f) { return f.seconds; }, [](const SweepRun& r) { return r.seconds; }},
        {"MiB moved to the device", "Bytes moved against the limit.", true, false, [=](const VariantFigures& f) { return f.bytes_loaded * mebi; },
         [=](const SweepRun& r) { return double(r.report.paging.bytes_loaded) * mebi; }},
        {"% of the time with nothing to trace", "Stall against the limit: the share of the time in which every ray waited for a block.", false, true,
         [](const VariantFigures& f) { return 100 * f.stall_share; },
         [](const SweepRun& r) { return r.seconds > 0 ? 100 * r.report.seconds.stall / r.seconds : 0; }}};
    std::string html;
    for (const Quantity& quantity : quantities) html += figure(limit_plot(result, figures, quantity), quantity.caption);
    return html;
}

std::string timelines(const SweepResult& result, uint32_t block_count) {
    std::string html;
    size_t count = 0;
    for (const SweepRun& run : result.runs) {
        if (run.repeat != 0 || run.report.paging.evictions == 0 || run.round_seconds.empty()) continue;
        const SweepVariant& v = result.variants[run.variant];
        if (++count > most_timelines) return html + "<p>Further timelines are left out.</p>\n";
        html += figure(svg_residency(rasterise_residency(run.journal, run.round_seconds, block_count)),
                       fmt::format("{} with {} resident: {} loads, {} evictions in {} rounds.", v.settings_name(), v.limit_name(),
                                   run.report.paging.loads, run.report.paging.evictions, run.report.paging.rounds));
    }
    return html.empty() ? "<p>No block had to leave in any of these runs.</p>\n" : html;
}

std::string figures_table(const SweepResult& result, const std::vector<VariantFigures>& figures) {
    std::string html =
        "<table><tr><th>resident<th class=l>settings<th>seconds<th>× roomiest<th>stall<th>Mrays/s<th>MiB moved<th>× scene<th>bytes per ray<th>rounds"
        "<th>RMSE<th>s to common RMSE</tr>\n";
    for (size_t i = 0; i < figures.size(); i++) {
        const VariantFigures& f = figures[i];
        html += fmt::format(
            "<tr><td>{}<td class=l>{}<td>{:.3f}<td>{:.3f}<td>{:.1f} %<td>{:.2f}<td>{:.1f}<td>{:.2f}<td>{:.2f}<td>{:.0f}<td>{:.4g}<td>{}</tr>\n",
            escape_markup(result.variants[i].limit_name()), escape_markup(result.variants[i].settings_name()), f.seconds, f.slow_down,
            100 * f.stall_share, f.rays_per_second * 1e-6, f.bytes_loaded / 1048576,
            result.geometry_bytes ? f.bytes_loaded / double(result.geometry_bytes) : 0.0, f.bytes_per_ray, f.rounds, f.rmse,
            f.seconds_to_rmse ? fmt::format("{:.3f}", *f.seconds_to_rmse) : "–");
    }
    return html + "</table>\n";
}

std::string film_verdict(const SweepResult& result) {
    if (!result.different_films.empty()) {
        std::string html = "<p class=bad>Films differ that must be the same. These measurements are worth nothing.</p><ul>\n";
        for (const std::string& line : result.different_films) html += "<li>" + escape_markup(line) + "</li>\n";
        return html + "</ul>\n";
    }
    std::vector<std::string> hashes;
    for (const SweepRun& run : result.runs) {
        const std::string hash = fmt::format("{} at {} samples per pixel: {}", run.report.connection, run.report.spp, hex64(run.report.film_hash));
        if (std::find(hashes.begin(), hashes.end(), hash) == hashes.end()) hashes.push_back(hash);
    }
    std::string html =
        "<p class=good>Every run with the same connection rule and number of samples ended in the same film, bit for bit. Film hashes: ";
    for (size_t i = 0; i < hashes.size(); i++) html += (i ? "; " : "") + escape_markup(hashes[i]);
    return html + ".</p>\n";
}

std::string conditions(const SweepResult& result, const SweepPageFacts& facts) {
    const RenderReport& r = result.runs.front().report;
    return fmt::format(
        "<p>{}, {}, {}x{} pixels, {} samples per pixel, at most {} scattering events, seed {}.<br>Device: {} ({}, driver {}).<br>"
        "raypager {}, {}. Command: <code>{}</code></p>\n"
        "<p>Error is the root mean square over pixels and channels against a reference of {} samples per pixel with another seed ({}), whose own "
        "error "
        "is at most about {:.2g} of that of the finished pictures. Time is that of rendering, without the snapshots that the curves are made of. "
        "Repeats "
        "were "
        "interleaved; tables hold medians. \"× roomiest\" is the median of the ratios to the same repeat at the largest limit.</p>\n",
        escape_markup(facts.scene), escape_markup(facts.primitives), r.width, r.height, r.spp, r.max_depth, r.seed, escape_markup(r.device.name),
        escape_markup(r.device.platform), escape_markup(r.device.driver), RAYPAGER_VERSION, escape_markup(facts.date), escape_markup(facts.command),
        result.reference.spp, escape_markup(result.reference.path.filename().string()), std::sqrt(double(r.spp) / double(result.reference.spp)));
}

}  // namespace

std::string sweep_page(const SweepResult& result, const SweepPageFacts& facts) {
    const auto figures = variant_figures(result);
    std::string html = "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content=\"width=device-width\"><title>raypager: " +
                       escape_markup(facts.scene) + "</title><style>" + style + "</style></head><body>\n";
    html += "<h1>" + escape_markup(facts.scene) + " at shrinking memory limits</h1>\n" + conditions(result, facts) + film_verdict(result);
    html += fmt::format("<h2>Figures</h2>\n{}<p>Common RMSE: {:.4g}.</p>\n", figures_table(result, figures), common_rmse(result));
    html += "<h2>Convergence</h2>\n";
    for (const std::string& name : settings_names(result))
        html += figure(convergence_plot(result, name), fmt::format("RMSE against time, {}. First repeat.", name));
    html += "<h2>Cost of less memory</h2>\n" + limit_plots(result, figures);
    html += "<h2>Residency</h2>\n" + timelines(result, facts.block_count);
    return html + "</body></html>\n";
}

}  // namespace raypager::bench
