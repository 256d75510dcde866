// A regular grid of heights as triangles, in tiles, and in as many meshes a tile as there are ground materials in it.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "procedural/scene_writer.hpp"

namespace raypager {

// Vertices lie at x = column * spacing, z = row * spacing, y = height(column, row), for columns and rows 0 .. quads inclusive.
struct HeightField {
    uint64_t columns = 1, rows = 1;  // quads; each is two triangles
    double spacing_x = 1, spacing_z = 1;
    std::function<double(double column, double row)> height;  // called from several threads
    double width() const { return static_cast<double>(columns) * spacing_x; }
    double depth() const { return static_cast<double>(rows) * spacing_z; }
    double height_at(double x, double z) const { return height(x / spacing_x, z / spacing_z); }
};

// What a quad of ground looks like from where it lies and how steep it is (upness: y of its unit normal). Called from several threads.
using GroundClassifier = std::function<uint8_t(double x, double y, double z, double upness)>;

// Tiles have at most max_mesh_triangles / 2 triangles and share their border positions exactly.
Status write_height_field(SceneWriter& scene, const HeightField& field, const std::vector<std::string_view>& materials,
                          const GroundClassifier& classify);

// The largest and the smallest height on a coarse grid of about steps x steps points.
struct HeightRange {
    double low, high;
};
HeightRange height_range(const HeightField& field, int steps = 200);

}  // namespace raypager
