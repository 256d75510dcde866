// Surfaces over a rectangular grid whose lines lie closer together around a place of interest than elsewhere.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "procedural/scene_writer.hpp"

namespace raypager {

// Maps 0 .. 1 onto low .. high, rising. At the focus, steps are narrowest: tightness (0 to 1) times those of an even axis. The focus lies within.
struct WarpedAxis {
    double low = 0, high = 1, focus = 0.5, tightness = 1;
    double at(double t) const;
    double inverse(double place) const;
    std::vector<double> lines(uint64_t steps) const;  // steps + 1 places
};

// Vertices at all x and z (rising), with smooth normals, seen from above. uv: 0 .. 1 along both axes, in step with the lines' numbers.
struct GridMesh {
    std::vector<double> x, z;
    std::function<double(size_t column, size_t row)> height;  // called from several threads
    Vector origin = {};                                       // becomes that of the mesh's coordinates
};

// Files NAME-000, NAME-001, ... of some hundred thousand triangles each.
Status write_grid_mesh(SceneWriter& scene, std::string_view name, std::string_view material, const GridMesh& grid);

}  // namespace raypager
