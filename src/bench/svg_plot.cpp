#include "bench/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace raypager::bench {
namespace {

constexpr double width = 720, height = 400, left = 74, right = 14, top = 12, bottom = 52;
constexpr double legend_line = 18;

constexpr std::array<const char*, 7> colors = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};
constexpr std::array<const char*, 4> dashes = {"", "7 3", "2 3", "9 3 2 3"};

// Maps values of one axis to a place in the drawing.
struct Axis {
    double low = 0, high = 1, from = 0, to = 1;
    bool logarithmic = false;
    double place(double value) const {
        const double part = logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
        return from + part * (to - from);
    }
    bool shows(double value) const { return std::isfinite(value) && (!logarithmic || value > 0); }
};

std::string number(double value) {
    if (value == 0) return "0";
    const double magnitude = std::abs(value);
    if (magnitude >= 1e-3 && magnitude < 1e5) return fmt::format("{:.10g}", std::round(value * 1e6) / 1e6);
    return fmt::format("{:.0e}", value);
}

// A mark of one of five shapes, about 7 units wide.
std::string mark(double x, double y, int style, double opacity) {
    const std::string look = fmt::format("fill=\"{}\" fill-opacity=\"{}\"", series_color(style), opacity);
    switch (style % 5) {
        case 0:
            return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.2\" {}/>", x, y, look);
        case 1:
            return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"6\" height=\"6\" {}/>", x - 3, y - 3, look);
        case 2:
            return fmt::format("<path d=\"M{:.1f} {:.1f}l4 7h-8z\" {}/>", x, y - 4, look);
        case 3:
            return fmt::format("<path d=\"M{:.1f} {:.1f}l4 4l-4 4l-4 -4z\" {}/>", x, y - 4, look);
        default:
            return fmt::format("<path d=\"M{:.1f} {:.1f}l4 -7h-8z\" {}/>", x, y + 4, look);
    }
}

std::string line_style(int style) {
    const char* dash = dashes[static_cast<size_t>(style) / colors.size() % dashes.size()];
    return fmt::format("fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}", series_color(style),
                       *dash ? fmt::format(" stroke-dasharray=\"{}\"", dash) : "");
}

struct Range {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    void add(double value) { low = std::min(low, value), high = std::max(high, value); }
    bool empty() const { return !(low <= high); }
};

// The extent of everything that both axes can show.
std::pair<Range, Range> extents(const Plot& plot) {
    Range x, y;
    const Axis ax{0, 1, 0, 1, plot.log_x}, ay{0, 1, 0, 1, plot.log_y};
    for (const PlotSeries& series : plot.series)
        for (const auto* points : {&series.points, &series.loose})
            for (const auto& [px, py] : *points)
                if (ax.shows(px) && ay.shows(py)) x.add(px), y.add(py);
    if (plot.y_from_zero && !y.empty()) y.add(0);
    return {x, y};
}

Axis fit_axis(const Range& range, bool logarithmic, double from, double to, AxisTicks& ticks, const std::vector<double>& given) {
    if (given.empty())
        ticks = logarithmic ? log_ticks(range.low, range.high) : linear_ticks(range.low, range.high);
    else
        ticks.values = given;
    Axis axis{std::min(range.low, ticks.values.front()), std::max(range.high, ticks.values.back()), from, to, logarithmic};
    if (axis.low == axis.high) axis.high = logarithmic ? axis.low * 2 : axis.low + 1;
    return axis;
}

std::string grid(const Plot& plot, const Axis& x, const Axis& y, const AxisTicks& x_ticks, const AxisTicks& y_ticks) {
    std::string svg;
    for (const double value : x_ticks.values) {
        const double at = x.place(value);
        svg += fmt::format("<path d=\"M{0:.1f} {1}V{2}\" class=\"grid\"/><text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4}</text>", at, top,
                           height - bottom, height - bottom + 16, number(value));
    }
    for (const double value : y_ticks.values) {
        const double at = y.place(value);
        svg += fmt::format("<path d=\"M{0} {1:.1f}H{2}\" class=\"grid\"/><text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>", left, at,
                           width - right, left - 6, at + 4, number(value));
    }
    svg += fmt::format("<path d=\"M{0} {1}V{2}H{3}\" class=\"axis\"/>", left, top, height - bottom, width - right);
    svg += fmt::format("<text x=\"{:.0f}\" y=\"{}\" text-anchor=\"middle\" class=\"label\">{}</text>", (left + width - right) / 2,
                       height - bottom + 38, escape_markup(plot.x_label));
    svg += fmt::format("<text transform=\"translate(16 {:.0f}) rotate(-90)\" text-anchor=\"middle\" class=\"label\">{}</text>",
                       (top + height - bottom) / 2, escape_markup(plot.y_label));
    return svg;
}

std::string draw_series(const PlotSeries& series, const Axis& x, const Axis& y) {
    std::string path, marks;
    for (const auto& [px, py] : series.points) {
        if (!x.shows(px) || !y.shows(py)) continue;
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x.place(px), y.place(py));
        if (series.marks) marks += mark(x.place(px), y.place(py), series.style, 1);
    }
    for (const auto& [px, py] : series.loose)
        if (x.shows(px) && y.shows(py)) marks += mark(x.place(px), y.place(py), series.style, 0.35);
    return path.empty() ? marks : fmt::format("<path d=\"{}\" {}/>", path, line_style(series.style)) + marks;
}

std::string legend(const Plot& plot) {
    std::string svg;
    double y = height + 6;
    for (const PlotSeries& series : plot.series) {
        svg += fmt::format("<path d=\"M{} {:.1f}h34\" {}/>", left, y, line_style(series.style));
        if (series.marks) svg += mark(left + 17, y, series.style, 1);
        svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\">{}</text>", left + 42, y + 4, escape_markup(series.name));
        y += legend_line;
    }
    return svg;
}

}  // namespace

AxisTicks linear_ticks(double low, double high) {
    if (!(high > low)) high = low + std::max(1.0, std::abs(low));
    const double rough = (high - low) / 5, decade = std::pow(10, std::floor(std::log10(rough)));
    double step = 10 * decade;
    for (const double factor : {5.0, 2.0, 1.0})
        if (factor * decade >= rough) step = factor * decade;
    AxisTicks ticks;
    const auto first = static_cast<int64_t>(std::floor(low / step)), last = static_cast<int64_t>(std::ceil(high / step));
    for (int64_t i = first; i <= last; i++) ticks.values.push_back(static_cast<double>(i) * step);
    return ticks;
}

AxisTicks log_ticks(double low, double high) {
    AxisTicks ticks;
    // Over few decades, 1, 2 and 5 of each; over many, each decade.
    const bool fine = high / low < 300;
    for (int decade = static_cast<int>(std::floor(std::log10(low))); decade <= static_cast<int>(std::ceil(std::log10(high))); decade++)
        for (const double factor : {1.0, 2.0, 5.0}) {
            if (!fine && factor != 1) continue;
            const double value = factor * std::pow(10, decade);
            if (!ticks.values.empty() && ticks.values.back() >= high) continue;
            if (value <= low && !ticks.values.empty()) ticks.values.clear();
            ticks.values.push_back(value);
        }
    return ticks;
}

std::string series_color(int style) { return colors[static_cast<size_t>(style) % colors.size()]; }

std::string escape_markup(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        if (c == '&')
            escaped += "&amp;";
        else if (c == '<')
            escaped += "&lt;";
        else if (c == '>')
            escaped += "&gt;";
        else if (c == '"')
            escaped += "&quot;";
        else
            escaped += c;
    }
    return escaped;
}

std::string svg_plot(const Plot& plot) {
    const double whole = height + 6 + legend_line * static_cast<double>(plot.series.size());
    std::string svg = fmt::format("<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{} against {}\">", width, whole,
                                  escape_markup(plot.y_label), escape_markup(plot.x_label));
    const auto [x_range, y_range] = extents(plot);
    if (x_range.empty()) return svg + fmt::format("<text x=\"{}\" y=\"{}\">no data</text></svg>", left, top + 20);
    AxisTicks x_ticks, y_ticks;
    const Axis x = fit_axis(x_range, plot.log_x, left, width - right, x_ticks, plot.x_ticks);
    const Axis y = fit_axis(y_range, plot.log_y, height - bottom, top, y_ticks, {});
    svg += grid(plot, x, y, x_ticks, y_ticks);
    for (const PlotSeries& series : plot.series) svg += draw_series(series, x, y);
    return svg + legend(plot) + "</svg>";
}

}  // namespace raypager::bench
