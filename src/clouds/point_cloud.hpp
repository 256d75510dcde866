// A shape that is a cloud -> spheres and points of the world.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "clouds/point_view.hpp"
#include "raypager/bake.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "world/world.hpp"

namespace raypager {

// What becomes of the points of a shape, one by one. REQUIRES: shape.points; the three live as long.
// Radii: options.radius; else the shape's point_radius; else each point's own, scaled with the shape; else from the spacing of
// the points in the world. All but the first two times the shape's and the options' radius_scale.
class PointRules {
public:
    PointRules(const Shape& shape, const Scene& scene, const PointOptions& options);
    // Moves a point into the world: transformed in double precision and rounded once. False: it is culled. An error names the shape:
    // the point is out of range.
    Result<bool> place(CloudPoint& point) const;
    // Of a placed point: whether its radius follows from the spacing around it.
    bool needs_spacing(const CloudPoint& point) const { return given_radius_ == 0 && (options_.radius_from_spacing || !(point.radius > 0)); }
    // Whether the radius of each point is clear before it is seen.
    bool radius_is_given() const { return given_radius_ > 0; }
    bool filters() const { return options_.filter_to_image; }
    const PointView& view() const { return view_; }
    float radius(const CloudPoint& point, float spacing) const;
    // Of a point that has its radius; nothing if that is 0, which issues counts. A coloured point's radius is rounded up to what its word can hold;
    // what had to be changed by more than that is counted in issues.
    std::optional<WorldSphere> sphere(const CloudPoint& point, MeshIssues& issues) const;

private:
    const Shape& shape_;
    const PointOptions& options_;
    const PointView view_;
    const bool identity_;
    const float scale_, given_radius_;
};

struct PlacedCloud {
    UnwrittenVector<WorldSphere> spheres;  // coloured points, or spheres if the source has no colours; in the order of the source
    uint64_t culled = 0;                   // left out because the camera does not see them
    uint64_t merged = 0;                   // left out because another point of the same pixel stands for them
};

// All of a cloud in memory, of which it takes placed_cloud_memory bytes a point on the way. An error names the shape: its source failed, or a
// point is out of range.
inline constexpr uint64_t placed_cloud_memory = 110;
Result<PlacedCloud> place_cloud(const Shape& shape, const PointRules& rules, MeshIssues& issues);

}  // namespace raypager
