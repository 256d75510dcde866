#include "bench/limit_curve.hpp"

#include <algorithm>
#include <cmath>

namespace raypager::bench {

std::optional<uint64_t> limit_for(std::span<const LimitPoint> points, double seconds) {
    if (points.size() < 2) return std::nullopt;
    double before = points.front().seconds;
    if (before <= seconds) return points.front().geometry_bytes;
    for (size_t i = 1; i < points.size(); i++) {
        const double now = std::min(before, points[i].seconds);
        if (now <= seconds) {
            const double from = std::log(static_cast<double>(points[i - 1].geometry_bytes)),
                         to = std::log(static_cast<double>(points[i].geometry_bytes));
            return static_cast<uint64_t>(std::llround(std::exp(from + (before - seconds) / (before - now) * (to - from))));
        }
        before = now;
    }
    return std::nullopt;
}

}  // namespace raypager::bench
