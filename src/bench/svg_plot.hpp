// Plots as SVG text, with nothing but lines, marks and words: they need no script and no font, and print well. Series differ in colour
// (Okabe and Ito's palette, for all kinds of colour vision), in dashes and in marks, so that they can be told apart on grey paper as well.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace raypager::bench {

struct PlotSeries {
    std::string name;
    std::vector<std::pair<double, double>> points;
    int style = 0;  // colour, dashes and mark
    bool marks = true;
    std::vector<std::pair<double, double>> loose;  // further marks without a line, such as single repeats
};

struct Plot {
    std::string x_label, y_label;  // with units
    bool log_x = false, log_y = false;
    std::vector<PlotSeries> series;
    bool y_from_zero = false;
    std::vector<double> x_ticks;  // empty: chosen
};

// An <svg> element. Points that a logarithmic axis cannot show are left out; a plot without points says so.
std::string svg_plot(const Plot& plot);

struct AxisTicks {
    std::vector<double> values;  // ascending, the first at or below the smallest value, the last at or above the largest
};
AxisTicks linear_ticks(double low, double high);
AxisTicks log_ticks(double low, double high);  // REQUIRES: 0 < low <= high

std::string series_color(int style);
std::string escape_markup(const std::string& text);  // for SVG and HTML

}  // namespace raypager::bench
