#include "clouds/point_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "block/point_code.hpp"
#include "clouds/point_intake.hpp"
#include "clouds/point_order.hpp"
#include "clouds/point_spacing.hpp"
#include "world/placement.hpp"

namespace raypager {
namespace {

// By how much a transform scales lengths, on average over directions.
double mean_scale(const Transform& t) {
    const auto& m = t.m;
    const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return std::cbrt(std::abs(determinant));
}

}  // namespace

PointRules::PointRules(const Shape& shape, const Scene& scene, const PointOptions& options)
    : shape_(shape),
      options_(options),
      view_(scene.camera, scene.width, scene.height, options.cull_to_camera ? options.cull_margin : 0),
      identity_(shape.to_world.is_identity()),
      scale_(static_cast<float>(identity_ ? 1.0 : mean_scale(shape.to_world))),
      given_radius_(options.radius > 0            ? options.radius
                    : options.radius_from_spacing ? 0
                                                  : shape.point_radius) {}

Result<bool> PointRules::place(CloudPoint& point) const {
    if (!identity_) {
        const auto p = shape_.to_world.point(point.position.x, point.position.y, point.position.z);
        point.position = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
    }
    point.radius *= scale_;
    const Float3& p = point.position;
    if (!in_range(p) || !(std::abs(point.radius) <= largest_coordinate))
        return Status::failed(
            fmt::format("{}: a point of radius {} lies at ({}, {}, {}) in the world; numbers up to {} are supported: scale the scene, or remove it",
                        shape_.name, point.radius, p.x, p.y, p.z, largest_coordinate));
    return !options_.cull_to_camera || view_.sees(p);
}

float PointRules::radius(const CloudPoint& point, float spacing) const {
    if (given_radius_ > 0) return given_radius_;
    return shape_.radius_scale * options_.radius_scale * (needs_spacing(point) ? point_radius_of_spacing * spacing : point.radius);
}

std::optional<WorldSphere> PointRules::sphere(const CloudPoint& point, MeshIssues& issues) const {
    if (!shape_.points->has_color()) {
        if (point.radius > 0) return WorldSphere{point.position, point.radius};
        issues.degenerate++;
        return {};
    }
    const uint32_t code = point_radius_code(point.radius);
    issues.changed_radius += !point_radius_fits(point.radius);
    return WorldSphere{point.position, point_radius(code), point_word(code, point_color_code(point.color))};
}

Result<PlacedCloud> place_cloud(const Shape& shape, const PointRules& rules, MeshIssues& issues) {
    PlacedCloud cloud;
    UnwrittenVector<CloudPoint> points;
    grow_huge(points, std::min<uint64_t>(shape.points->count(), RP_NONE));
    PointPlacer placer(rules);
    const auto take = [&](std::span<const CloudPoint> piece) { return placer.place(piece, points); };
    if (auto status = shape.points->stream(take, issues); !status.ok()) return status;
    cloud.culled = placer.culled();
    const bool by_spacing = placer.needs_spacing();
    PointOrder order;
    if (by_spacing || rules.filters()) order = make_point_order(points);
    const std::vector<float> spacing = by_spacing ? estimate_point_spacing(points, order) : std::vector<float>();
    parallel_for(points.size(), intake_piece, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) points[i].radius = rules.radius(points[i], by_spacing ? spacing[i] : 0);
    });
    const bool filters = rules.filters();
    const std::vector<bool> kept = filters ? filter_to_pixels(points, order, rules.view()) : std::vector<bool>();
    append_made(cloud.spheres, points.size(), issues, [&](size_t i, MeshIssues& found) -> std::optional<WorldSphere> {
        if (filters && !kept[i]) return {};
        return rules.sphere(points[i], found);
    });
    cloud.merged = static_cast<uint64_t>(std::ranges::count(kept, false));
    return cloud;
}

}  // namespace raypager
