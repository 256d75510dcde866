// Meshes and point clouds that come without a scene: they get a camera, light and ground, so that the picture is worth looking at.
#pragma once

#include <filesystem>
#include <vector>

#include "raypager/import.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Which way is up: +y, unless the meshes say otherwise. They say "+z" in one of two ways:
// - they are an open sheet facing z, such as a terrain: the sum of all triangles' area vectors (zero for a closed surface) along z is
//   more than half of the bounding box's base there, and larger than that along y;
// - they stand on z: the part of the bounding box's base that is covered by triangles which face down, within 2 % of the bottom, is more
//   than 5 % for z and more than three times that for y.
// Clouds say "+z" by their format (LAS and text are surveyors'), by coordinates far from the origin, or by being flat along z.
// A cloud that is a landscape gets sun and sky instead of a key light, and no ground: it has its own. Clouds far from the origin are shown relative
// to a nearer one, all to the same; a warning names it.
// Meshes of more than 2^20 triangles that can be read in pieces are framed by a sample of them. keep_bytes: of meshes that have been read and
// stay in memory for the bake.
Result<Scene> import_bare(const std::vector<std::filesystem::path>& paths, const ImportOptions& options);

}  // namespace raypager
