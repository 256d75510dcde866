#include "scene/point_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/box4.hpp"

namespace raypager {
namespace {

constexpr size_t neighbour = 3;  // the one whose distance counts
constexpr float infinity = std::numeric_limits<float>::infinity();
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

// Squared distances of the points from their nearest neighbours that do not lie in the same place. Those that have none are left out.
std::vector<float> nearest_distances(std::span<const Float3> points) {
    std::vector<float> distances;
    for (size_t i = 0; i < points.size(); i++) {
        float nearest = infinity;
        for (const Float3& other : points)
            if (const float d = distance_squared(points[i], other); d > 0) nearest = std::min(nearest, d);
        if (nearest < infinity) distances.push_back(nearest);
    }
    return distances;
}

// Those from their third nearest neighbours, of eight points at a time: comparing all is faster than any tree for the tens of points of a cell.
std::vector<float> neighbour_distances(std::span<const Float3> points) {
    constexpr size_t lanes = 4, groups = 2, at_once = lanes * groups;
    std::vector<float> distances;
    distances.reserve(points.size());
    for (size_t first = 0; first < points.size(); first += at_once) {
        const size_t count = std::min(at_once, points.size() - first);
        Float4 x[groups] = {}, y[groups] = {}, z[groups] = {}, nearest[groups][neighbour + 1];
        for (size_t i = 0; i < count; i++) {
            const Float3& p = points[first + i];
            x[i / lanes][i % lanes] = p.x, y[i / lanes][i % lanes] = p.y, z[i / lanes][i % lanes] = p.z;
        }
        for (auto& of_group : nearest)
            for (Float4& known : of_group) known = Float4{infinity, infinity, infinity, infinity};
        for (const Float3& p : points) {
            for (size_t g = 0; g < groups; g++) {
                const Float4 a = x[g] - p.x, b = y[g] - p.y, c = z[g] - p.z;
                Float4 d = a * a + b * b + c * c;
                for (Float4& known : nearest[g]) {
                    const Float4 farther = greatest(known, d);
                    known = least(known, d);
                    d = farther;
                }
            }
        }
        // The nearest of all is the point itself.
        for (size_t i = 0; i < count; i++)
            if (const float d = nearest[i / lanes][neighbour][i % lanes]; d < infinity) distances.push_back(d);
    }
    return distances;
}

}  // namespace

float compared_spacing(std::span<const Float3> points) {
    if (points.size() < 2) return 0;
    const bool few = points.size() < min_surface_points;
    std::vector<float> distances = few ? nearest_distances(points) : neighbour_distances(points);
    const float spacing = std::sqrt(middle_of(distances));
    if (!few) return spacing;
    const float share = std::max(min_share, static_cast<float>(points.size()) / min_surface_points);
    return std::max(share * spacing, points.size() <= without_strays ? min_of_extent * extent_of(points) : 0.0f);
}

}  // namespace raypager
