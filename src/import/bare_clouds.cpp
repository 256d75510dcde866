#include "import/bare_clouds.hpp"

#include <algorithm>

namespace raypager {
namespace {

// Points further out than this share of the middle ones' extent, on an axis, are strays (birds, reflections): the picture is not for them.
constexpr double stray_margin = 0.25;
constexpr double stray_share = 0.002;  // of the points on either side are not looked at to find that extent

struct Interval {
    double low, high;
};

Interval without_strays(const std::vector<Vector>& points, size_t axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const Vector& p : points) values.push_back(p[axis]);
    const auto spare = static_cast<ptrdiff_t>(stray_share * static_cast<double>(values.size()));
    std::nth_element(values.begin(), values.begin() + spare, values.end());
    const double low = values[static_cast<size_t>(spare)];
    std::nth_element(values.begin(), values.end() - 1 - spare, values.end());
    const double high = *(values.end() - 1 - spare);
    const double margin = stray_margin * (high - low);
    return {low - margin, high + margin};
}

}  // namespace

Result<CloudSurvey> survey_clouds(const std::vector<std::shared_ptr<const CloudFile>>& clouds) {
    CloudSurvey survey;
    if (clouds.empty()) return survey;
    survey.origin = clouds.front()->origin();
    std::vector<Vector> points;
    for (const auto& cloud : clouds) {
        const auto sample = cloud->sample();
        if (!sample) return sample.status();
        if (sample->empty()) return Status::failed(cloud->name() + ": has no point that can be shown");
        const Vector shift = cloud->origin() - survey.origin;
        for (const CloudPoint& p : *sample) points.push_back(vector(p.position) + shift);
        survey.z_up = survey.z_up || cloud->z_up() || cloud->origin() != Vector{0, 0, 0};
    }
    const Interval x = without_strays(points, 0), y = without_strays(points, 1), z = without_strays(points, 2);
    for (const Vector& p : points) {
        const auto inside = [&](size_t axis, const Interval& interval) { return p[axis] >= interval.low && p[axis] <= interval.high; };
        if (!inside(0, x) || !inside(1, y) || !inside(2, z)) continue;
        survey.points.push_back(p);
        for (size_t a = 0; a < 3; ++a) {
            survey.lower[a] = std::min(survey.lower[a], p[a]);
            survey.upper[a] = std::max(survey.upper[a], p[a]);
        }
    }
    // All of them may be strays of one another: two points far apart.
    if (survey.points.empty()) return Status::failed(clouds.front()->name() + ": has too few points to make a picture of");
    const Vector extent = survey.upper - survey.lower;
    const bool flat = extent[2] < 0.5 * std::min(extent[0], extent[1]);
    survey.z_up = survey.z_up || flat;
    survey.landscape = survey.z_up && flat;
    return survey;
}

}  // namespace raypager
