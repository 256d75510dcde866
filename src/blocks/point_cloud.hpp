// A shape that is a cloud -> spheres and points of the world.
#pragma once

#include <cstdint>
#include <vector>

#include "blocks/world.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// What to make of points when they are baked.
struct PointOptions {
    float radius = 0;                  // of all points, in the world; 0: as the shapes say
    bool radius_from_spacing = false;  // also where shapes or files give a radius
    float radius_scale = 1;            // of all radii but those given as `radius`
    bool cull_to_camera = false;       // leave out what the scene's camera does not see
    float cull_margin = 0.1f;          // beyond the picture's border, as a share of half the picture's sides
    bool filter_to_image = false;      // keep about one point a pixel of the scene's camera
};

struct PlacedCloud {
    std::vector<WorldSphere> spheres;  // coloured points, or spheres if the source has no colours
    uint64_t culled = 0;               // left out because the camera does not see them
    uint64_t merged = 0;               // left out because another point of the same pixel stands for them
};

// REQUIRES: shape.points. Positions are transformed in double precision and rounded once. The order is that of the source.
// Radii: options.radius; else the shape's point_radius; else each point's own, scaled with the shape; else from the spacing of
// the points in the world. All but the first two times the shape's and the options' radius_scale. A coloured point's radius is
// rounded up to what its word can hold; what had to be changed by more than that is counted in issues.
// An error names the shape: its source failed, or a coordinate is beyond largest_coordinate.
Result<PlacedCloud> place_cloud(const Shape& shape, const Scene& scene, const PointOptions& options, double largest_coordinate, MeshIssues& issues);

}  // namespace raypager
