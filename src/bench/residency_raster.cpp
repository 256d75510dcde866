#include "bench/residency_raster.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "bench/svg_plot.hpp"

namespace raypager::bench {
namespace {

// From light to dark, about even in lightness, so that print in grey keeps their order (after ColorBrewer's "Blues").
constexpr std::array<const char*, ResidencyRaster::full> shade_colors = {"#deebf7", "#c6dbef", "#9ecae1", "#6baed6",
                                                                         "#4292c6", "#2171b5", "#08519c", "#08306b"};

}  // namespace

ResidencyRaster rasterise_residency(const std::vector<PagingEvent>& journal, const std::vector<float>& round_seconds, uint32_t block_count,
                                    uint32_t most_columns, uint32_t most_rows) {
    ResidencyRaster raster;
    if (round_seconds.empty() || block_count == 0) return raster;
    raster.blocks = block_count;
    raster.seconds = round_seconds.back();
    const uint32_t a_row = (block_count + most_rows - 1) / most_rows;
    raster.rows = (block_count + a_row - 1) / a_row;
    raster.columns = std::min<uint32_t>(most_columns, static_cast<uint32_t>(round_seconds.size()));
    raster.shades.assign(size_t{raster.columns} * raster.rows, 0);
    std::vector<uint32_t> resident(raster.rows);
    size_t next = 0;
    for (uint32_t column = 0; column < raster.columns; column++) {
        const double middle = (column + 0.5) / raster.columns * raster.seconds;
        // An event counts from the end of its round on.
        for (; next < journal.size() && round_seconds[std::min<size_t>(journal[next].round - 1, round_seconds.size() - 1)] <= middle; next++)
            resident[journal[next].block / a_row] += journal[next].came ? 1u : UINT32_MAX;
        for (uint32_t row = 0; row < raster.rows; row++) {
            const uint32_t in_row = std::min(a_row, block_count - row * a_row);
            const uint32_t shade = (resident[row] * ResidencyRaster::full + in_row - 1) / in_row;  // something resident always shows
            raster.shades[size_t{row} * raster.columns + column] = static_cast<uint8_t>(std::min<uint32_t>(shade, ResidencyRaster::full));
        }
    }
    return raster;
}

std::string svg_residency(const ResidencyRaster& raster) {
    constexpr double left = 74, top = 8, wide = 632, high = 256;
    std::string svg = fmt::format("<svg viewBox=\"0 0 720 {:.0f}\" role=\"img\" aria-label=\"resident blocks over time\">", top + high + 74);
    if (raster.shades.empty()) return svg + "<text x=\"74\" y=\"28\">no data</text></svg>";
    std::array<std::string, ResidencyRaster::full + 1> paths;
    for (uint32_t row = 0; row < raster.rows; row++) {
        const uint8_t* shades = raster.shades.data() + size_t{row} * raster.columns;
        for (uint32_t begin = 0, end = 0; begin < raster.columns; begin = end) {
            for (end = begin; end < raster.columns && shades[end] == shades[begin];) end++;
            if (shades[begin]) paths[shades[begin]] += fmt::format("M{} {}h{}v1h-{}z", begin, row, end - begin, end - begin);
        }
    }
    svg += fmt::format("<g transform=\"translate({} {}) scale({:.5f} {:.5f})\" shape-rendering=\"crispEdges\">", left, top, wide / raster.columns,
                       high / raster.rows);
    for (size_t shade = 1; shade < paths.size(); shade++)
        if (!paths[shade].empty()) svg += fmt::format("<path fill=\"{}\" d=\"{}\"/>", shade_colors[shade - 1], paths[shade]);
    svg += fmt::format("</g><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" class=\"axis\"/>", left, top, wide, high);
    const AxisTicks ticks = linear_ticks(0, raster.seconds);
    for (const double value : ticks.values)
        if (value <= raster.seconds)
            svg += fmt::format("<path d=\"M{0:.1f} {1}v4\" class=\"axis\"/><text x=\"{0:.1f}\" y=\"{2}\" text-anchor=\"middle\">{3:g}</text>",
                               left + value / raster.seconds * wide, top + high, top + high + 17, value);
    svg += fmt::format("<text x=\"{:.0f}\" y=\"{}\" text-anchor=\"middle\" class=\"label\">seconds</text>", left + wide / 2, top + high + 36);
    svg += fmt::format("<text transform=\"translate(16 {:.0f}) rotate(-90)\" text-anchor=\"middle\" class=\"label\">block (of {})</text>",
                       top + high / 2, raster.blocks);
    svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\">1</text><text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>", left - 6,
                       top + 10, left - 6, top + high, raster.blocks);
    double x = left;
    for (size_t shade = 0; shade < shade_colors.size(); shade++, x += 22)
        svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"22\" height=\"10\" fill=\"{}\"/>", x, top + high + 52, shade_colors[shade]);
    return svg + fmt::format("<text x=\"{}\" y=\"{}\">share of a cell's blocks that is resident: some to all; white: none</text></svg>", x + 8,
                             top + high + 61);
}

}  // namespace raypager::bench
