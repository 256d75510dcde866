// Colours of vertices and faces, on their way from a file to a mesh.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "import/polygons.hpp"

namespace raypager {

// Of what has no colour in a file in which other things have: a light grey.
inline constexpr uint32_t no_color = 0xc8c8c8;

// From 0 to 1 each; what is not a number counts as 0.
inline uint32_t pack_color(double red, double green, double blue) {
    const auto byte = [](double x) { return x > 0 ? static_cast<uint32_t>(std::lround(255 * std::min(x, 1.0))) : 0u; };
    return byte(red) | byte(green) << 8 | byte(blue) << 16;
}

// The scale of colours of which the largest number is known: 1, 255 or 65535, the smallest that holds them all.
inline double color_scale(double largest) { return largest <= 1 ? 1 : largest <= 255 ? 255 : 65535; }

// Gives the vertices the colours of the corners of the polygons, where they have any; vertices are split where these differ. Vertices that get none
// keep theirs.
inline void color_corners(TriangleMesh& mesh, PolygonBuilder& polygons) {
    if (polygons.attributes().empty()) return;
    const SplitVertices split = split_vertices(mesh.triangles, polygons.attributes(), mesh.positions.size());
    append_copies(mesh.positions, split);
    if (!mesh.normals.empty()) append_copies(mesh.normals, split);
    if (!mesh.uvs.empty()) append_copies(mesh.uvs, split);
    if (mesh.colors.empty()) mesh.colors.assign(mesh.positions.size() - split.source.size(), no_color);
    append_copies(mesh.colors, split);
    for (size_t i = 0; i < mesh.colors.size(); ++i)
        if (split.attribute[i] != RP_NONE) mesh.colors[i] = split.attribute[i];
}

}  // namespace raypager
