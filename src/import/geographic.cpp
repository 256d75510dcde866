#include "import/geographic.hpp"

#include <algorithm>
#include <cmath>

namespace raypager {
namespace {

constexpr double min_slope = 200, largest_angle = 180;
constexpr size_t least_points = 5;

// Without a tenth of them at either end: a few strays make no needle.
double extent(std::vector<double>& values) {
    const auto spare = static_cast<ptrdiff_t>((values.size() + 9) / 10);
    std::nth_element(values.begin(), values.begin() + spare, values.end());
    const double low = values[static_cast<size_t>(spare)];
    std::nth_element(values.begin(), values.end() - 1 - spare, values.end());
    return *(values.end() - 1 - spare) - low;
}

}  // namespace

std::string seems_geographic(std::span<const FilePoint> sample, bool said) {
    std::vector<double> values[3];
    size_t outside = 0, whole = 0;
    for (const FilePoint& p : sample) {
        const auto& [x, y, z] = p.position;
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) continue;
        outside += std::abs(x) > 2 * largest_angle || std::abs(y) > largest_angle || (!said && std::abs(x) > largest_angle);
        whole += x == std::floor(x) && y == std::floor(y);
        for (size_t a = 0; a < 3; ++a) values[a].push_back(p.position[a]);
    }
    const size_t count = values[0].size();
    if (count < (said ? size_t{1} : least_points) || 50 * outside > count) return {};
    if (said) return "the file says that x and y are longitude and latitude";
    const double across = std::max(extent(values[0]), extent(values[1])), upright = extent(values[2]);
    if (2 * whole > count || !(across > 0) || upright < min_slope * across) return {};
    return "x and y look like longitude and latitude in degrees, and z like metres";
}

}  // namespace raypager
