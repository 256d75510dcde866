// Loads a scene's shapes and places them in the world.
#pragma once

#include <functional>

#include "blocks/point_cloud.hpp"
#include "blocks/world.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct Gathered {
    World world;
    std::vector<rp_primitive_range> ranges;
    std::vector<rp_light> lights;  // emissive primitives, then the scene's own lights; probabilities filled in
    MeshIssues issues;
    uint64_t points_culled = 0, points_merged = 0;
};

// Primitives are numbered in the order of scene.shapes. Positions are transformed in double precision and rounded once. Primitives that
// no ray can hit once their vertices are rounded (no area, radius 0) are dropped and counted.
// An error names the shape: its mesh cannot be loaded, a coordinate is beyond +-1e18, or there are 2^32 - 1 primitives or vertices or more.
Result<Gathered> gather(const Scene& scene, const std::function<void(double fraction)>& progress, const PointOptions& points = {});

}  // namespace raypager
