#include "blocks/point_cloud.hpp"

#include <fmt/format.h>

#include <cmath>

#include "blocks/point_code.hpp"
#include "blocks/point_order.hpp"
#include "blocks/point_spacing.hpp"
#include "blocks/point_view.hpp"

namespace raypager {
namespace {

// By how much a transform scales lengths, on average over directions.
double mean_scale(const Transform& t) {
    const auto& m = t.m;
    const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return std::cbrt(std::abs(determinant));
}

class CloudPlacer {
public:
    CloudPlacer(const Shape& shape, const Scene& scene, const PointOptions& options, double largest_coordinate, MeshIssues& issues)
        : shape_(shape),
          options_(options),
          largest_coordinate_(largest_coordinate),
          issues_(issues),
          view_(scene.camera, scene.width, scene.height, options.cull_to_camera ? options.cull_margin : 0) {}

    Result<PlacedCloud> run() {
        RAYPAGER_TRY(load());
        const float given = given_radius();
        const bool by_spacing = given == 0 && !std::all_of(points_.begin(), points_.end(), [&](const CloudPoint& p) { return has_own_radius(p); });
        PointOrder order;
        if (by_spacing || options_.filter_to_image) order = make_point_order(points_);
        set_radii(given, by_spacing ? estimate_point_spacing(points_, order) : std::vector<float>());
        std::vector<bool> kept(points_.size(), true);
        if (options_.filter_to_image) kept = filter_to_pixels(points_, order, view_);
        for (size_t i = 0; i < points_.size(); i++) {
            if (kept[i])
                add(points_[i]);
            else
                cloud_.merged++;
        }
        return std::move(cloud_);
    }

private:
    // In world space, without what is culled.
    Status load() {
        const bool identity = shape_.to_world.is_identity();
        const auto scale = static_cast<float>(identity ? 1.0 : mean_scale(shape_.to_world));
        return shape_.points->stream(
            [&](std::span<const CloudPoint> piece) -> Status {
                for (CloudPoint point : piece) {
                    if (!identity) {
                        const auto p = shape_.to_world.point(point.position.x, point.position.y, point.position.z);
                        point.position = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
                    }
                    point.radius *= scale;
                    RAYPAGER_TRY(check_range(point));
                    if (options_.cull_to_camera && !view_.sees(point.position))
                        cloud_.culled++;
                    else
                        points_.push_back(point);
                }
                return {};
            },
            issues_);
    }

    Status check_range(const CloudPoint& point) const {
        const Float3& p = point.position;
        const auto inside = [&](float x) { return std::abs(x) <= largest_coordinate_; };
        if (inside(p.x) && inside(p.y) && inside(p.z) && inside(point.radius)) return {};
        return Status::failed(
            fmt::format("{}: a point of radius {} lies at ({}, {}, {}) in the world; numbers up to {} are supported: scale the scene, or remove it",
                        shape_.name, point.radius, p.x, p.y, p.z, largest_coordinate_));
    }

    // One for all points, or 0.
    float given_radius() const { return options_.radius > 0 ? options_.radius : options_.radius_from_spacing ? 0 : shape_.point_radius; }
    bool has_own_radius(const CloudPoint& point) const { return point.radius > 0 && !options_.radius_from_spacing; }

    // spacing: of each point, or none if every point has a radius.
    void set_radii(float given, const std::vector<float>& spacing) {
        const float scale = shape_.radius_scale * options_.radius_scale;
        for (size_t i = 0; i < points_.size(); i++) {
            float& radius = points_[i].radius;
            radius = given > 0 ? given : scale * (has_own_radius(points_[i]) ? radius : point_radius_of_spacing * spacing[i]);
        }
    }

    void add(const CloudPoint& point) {
        if (!shape_.points->has_color()) {
            if (point.radius > 0)
                cloud_.spheres.push_back({point.position, point.radius, RP_NONE});
            else
                issues_.degenerate++;
            return;
        }
        const uint32_t code = point_radius_code(point.radius);
        issues_.changed_radius += !point_radius_fits(point.radius);
        cloud_.spheres.push_back({point.position, point_radius(code), point_word(code, point_color_code(point.color))});
    }

    const Shape& shape_;
    const PointOptions& options_;
    const double largest_coordinate_;
    MeshIssues& issues_;
    const PointView view_;
    std::vector<CloudPoint> points_;
    PlacedCloud cloud_;
};

}  // namespace

Result<PlacedCloud> place_cloud(const Shape& shape, const Scene& scene, const PointOptions& options, double largest_coordinate, MeshIssues& issues) {
    return CloudPlacer(shape, scene, options, largest_coordinate, issues).run();
}

}  // namespace raypager
