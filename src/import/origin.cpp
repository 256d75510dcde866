#include "import/origin.hpp"

#include <algorithm>
#include <cmath>

namespace raypager {
namespace {

// Coordinates up to here keep a resolution of about a millimetre if their unit is the metre.
constexpr double near_coordinate = 16384, origin_step = 1000;

struct Spread {
    double middle = 0, extent = 0;  // the extent leaves out a twentieth at each end
};

Spread spread_along(const std::vector<FilePosition>& sample, size_t axis) {
    std::vector<double> values;
    for (const FilePosition& p : sample)
        if (is_usable(p)) values.push_back(p[axis]);
    if (values.empty()) return {};
    const auto at = [&](size_t i) {
        std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(i), values.end());
        return values[i];
    };
    const size_t end = values.size() / 20;
    return {at(values.size() / 2), at(values.size() - 1 - end) - at(end)};
}

}  // namespace

bool is_usable(const FilePosition& position) {
    // False for what is not a number, too.
    return std::all_of(position.begin(), position.end(), [](double x) { return std::abs(x) <= largest_file_coordinate; });
}

FilePosition choose_origin(const std::vector<FilePosition>& sample) {
    FilePosition origin = {0, 0, 0};
    for (size_t a = 0; a < 3; ++a) {
        const Spread spread = spread_along(sample, a);
        if (std::abs(spread.middle) > std::max(near_coordinate, spread.extent)) origin[a] = std::round(spread.middle / origin_step) * origin_step;
    }
    return origin;
}

double remoteness(const std::vector<FilePosition>& sample) {
    double distance = 0, extent = 0;
    for (size_t a = 0; a < 3; ++a) {
        const Spread spread = spread_along(sample, a);
        distance = std::max(distance, std::abs(spread.middle));
        extent = std::max(extent, spread.extent);
    }
    return extent > 0 ? distance / extent : 0;
}

}  // namespace raypager
