#include "scene/point_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace raypager {
namespace {

constexpr size_t neighbour = 3;  // the one whose distance counts
constexpr float min_share = 0.25f;
// Of two or three points none can be called a stray, so that the smallest ball must be seen beside the whole.
constexpr size_t without_strays = 3;
constexpr float min_of_extent = 1.0f / 40;

// The middle of what is left when zeros (points in the same place as others) are not counted; 0 if nothing is.
float middle_of(std::vector<float>& values) {
    std::erase(values, 0.0f);
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

float distance_squared(const Float3& a, const Float3& b) {
    const float x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
    return x * x + y * y + z * z;
}

float extent_of(std::span<const Float3> points) {
    float largest = 0;
    for (const Float3& p : points) largest = std::max(largest, distance_squared(p, points[0]));
    return std::sqrt(largest);
}

}  // namespace

float compared_spacing(std::span<const Float3> points) {
    if (points.size() < 2) return 0;
    const bool few = points.size() < min_surface_points;
    const size_t rank = few ? 1 : neighbour;
    std::vector<float> distances;
    distances.reserve(points.size());
    for (size_t i = 0; i < points.size(); i++) {
        std::array<float, neighbour> nearest;
        nearest.fill(std::numeric_limits<float>::infinity());
        for (size_t j = 0; j < points.size(); j++) {
            float d = i == j ? std::numeric_limits<float>::infinity() : distance_squared(points[i], points[j]);
            if (few && d == 0) continue;  // as many may be in the same place
            for (float& known : nearest)
                if (d < known) std::swap(d, known);
        }
        if (nearest[rank - 1] < std::numeric_limits<float>::infinity()) distances.push_back(nearest[rank - 1]);
    }
    const float spacing = std::sqrt(middle_of(distances));
    if (!few) return spacing;
    const float share = std::max(min_share, static_cast<float>(points.size()) / min_surface_points);
    return std::max(share * spacing, points.size() <= without_strays ? min_of_extent * extent_of(points) : 0.0f);
}

}  // namespace raypager
