#include "import/bare_clouds.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/point_distance.hpp"

namespace raypager {
namespace {

// Points further out than this share of the middle ones' extent, on an axis, are strays (birds, reflections): the picture is not for them.
constexpr double stray_margin = 0.25;
constexpr double stray_share = 0.002;  // of the points on either side are not looked at to find that extent

// Of few points, no such share can be left out: there, a stray is what lies further from the middle half of the points than this many times the
// largest extent of that half, unless there are too many of them.
constexpr size_t few_points = 500, min_points_with_strays = 4;
constexpr double few_stray_margin = 5, most_few_strays = 0.03;

constexpr size_t most_measured = 4096;  // points; the balls of more are too small to matter for the frame

struct Interval {
    double low, high;
};

bool is_inside(const std::array<Interval, 3>& box, const Vector& p) {
    for (size_t a = 0; a < 3; ++a)
        if (!(p[a] >= box[a].low && p[a] <= box[a].high)) return false;
    return true;
}

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

std::array<Interval, 3> middle_halves(const std::vector<Vector>& points) {
    std::array<Interval, 3> halves;
    std::vector<double> values;
    for (size_t a = 0; a < 3; ++a) {
        values.clear();
        for (const Vector& p : points) values.push_back(p[a]);
        std::sort(values.begin(), values.end());
        const size_t quarter = values.size() / 4;
        halves[a] = {values[quarter], values[values.size() - 1 - quarter]};
    }
    return halves;
}

// Where the points are that the picture is for.
std::array<Interval, 3> subject_of(const std::vector<Vector>& points) {
    if (points.size() >= few_points) return {without_strays(points, 0), without_strays(points, 1), without_strays(points, 2)};
    const std::array<Interval, 3> everything = {Interval{-INFINITY, INFINITY}, {-INFINITY, INFINITY}, {-INFINITY, INFINITY}};
    if (points.size() < min_points_with_strays) return everything;
    std::array<Interval, 3> halves = middle_halves(points);
    double extent = 0;
    for (const Interval& half : halves) extent = std::max(extent, half.high - half.low);
    for (Interval& half : halves) half = {half.low - few_stray_margin * extent, half.high + few_stray_margin * extent};
    const auto strays = std::count_if(points.begin(), points.end(), [&](const Vector& p) { return !is_inside(halves, p); });
    const bool plausible = extent > 0 && static_cast<double>(strays) <= std::max(1.0, most_few_strays * static_cast<double>(points.size()));
    return plausible ? halves : everything;
}

// About the radius that points without one get when they are baked, or the largest that they have.
double ball_radius(const std::vector<Vector>& points, double largest_own) {
    if (largest_own > 0 || points.size() > most_measured) return largest_own;
    std::vector<Float3> positions;
    for (const Vector& p : points) positions.push_back(float3(p));
    const float spacing = compared_spacing(positions);
    return point_radius_of_spacing * (spacing > 0 ? spacing : 1.0f);
}

// Reading says where and why, if it can.
Status nothing_to_show(const CloudFile& cloud) {
    MeshIssues issues;
    RAYPAGER_TRY(cloud.stream([](std::span<const CloudPoint>) { return Status(); }, issues));
    return Status::failed(cloud.name() + ": has no point that can be shown");
}

}  // namespace

Result<CloudSurvey> survey_clouds(const std::vector<std::shared_ptr<const CloudFile>>& clouds) {
    CloudSurvey survey;
    if (clouds.empty()) return survey;
    survey.origin = clouds.front()->origin();
    std::vector<Vector> points;
    std::vector<double> radii;
    for (const auto& cloud : clouds) {
        const auto sample = cloud->sample();
        if (!sample) return sample.status();
        if (sample->empty()) return nothing_to_show(*cloud);
        const Vector shift = cloud->origin() - survey.origin;
        for (const CloudPoint& p : *sample) {
            points.push_back(vector(p.position) + shift);
            radii.push_back(p.radius);
        }
        survey.z_up = survey.z_up || cloud->z_up() || cloud->origin() != Vector{0, 0, 0};
    }
    const auto subject = subject_of(points);
    double largest_own = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        if (!is_inside(subject, points[i])) continue;
        survey.points.push_back(points[i]);
        largest_own = std::max(largest_own, radii[i]);
    }
    // All of them may be strays of one another: two groups far apart.
    if (survey.points.empty()) survey.points = points;
    survey.ball = ball_radius(survey.points, largest_own);
    for (const Vector& p : survey.points)
        for (size_t a = 0; a < 3; ++a) {
            survey.lower[a] = std::min(survey.lower[a], p[a] - survey.ball);
            survey.upper[a] = std::max(survey.upper[a], p[a] + survey.ball);
        }
    const Vector extent = survey.upper - survey.lower;
    const bool flat = extent[2] < 0.5 * std::min(extent[0], extent[1]);
    survey.z_up = survey.z_up || flat;
    survey.landscape = survey.z_up && flat;
    return survey;
}

}  // namespace raypager
