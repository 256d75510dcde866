// The faces of a mesh, as its readers find them, on their way to triangles.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

// Appends polygons to the triangles of a mesh. Convex ones are cut into fans from their first corner; concave ones along their outline, as soon as
// the places of their vertices are known.
class PolygonBuilder {
public:
    PolygonBuilder(TriangleMesh& mesh, MeshIssues& issues) : mesh_(mesh), issues_(issues) {}

    // attributes: something that each corner has of its own (the number of a normal, a colour), RP_NONE where it has not; as many as corners, or
    // none.
    void add(std::span<const uint32_t> corners, std::span<const uint32_t> attributes = {});

    // Puts the position of a vertex into the array; false if there is no such vertex, or not one that is finite.
    using PositionOf = std::function<bool(uint32_t vertex, std::array<double, 3>& position)>;
    // Cuts the concave ones among the polygons that came since the last call. REQUIRES: their triangles are still where they were put.
    void cut_concave(const PositionOf& position);
    // With the positions of the mesh.
    void cut_concave();
    bool any_to_cut() const { return !polygons_.empty(); }
    std::vector<uint32_t> vertices_to_cut() const;  // of those polygons; some more than once

    // Of the corners of each triangle; empty if no polygon had any.
    std::vector<Triangle>& attributes() { return attributes_; }

private:
    struct Polygon {
        uint32_t first, corners;  // first: triangle
    };
    // Of a fan: the first two corners, and then one a triangle.
    static std::vector<uint32_t> corners_of(const Polygon& polygon, const std::vector<Triangle>& triangles);
    // False if the outline crosses itself.
    bool cut(const Polygon& polygon, const PositionOf& position);

    TriangleMesh& mesh_;
    MeshIssues& issues_;
    std::vector<Triangle> attributes_;
    std::vector<Polygon> polygons_;  // of four corners and more
};

// Splits vertices whose corners differ in their attribute, so that each vertex has one. Of two corners of a vertex that have none, both keep it.
struct SplitVertices {
    std::vector<uint32_t> attribute;  // of each vertex, RP_NONE: none
    std::vector<uint32_t> source;     // of the vertices that were added: which one each is a copy of
};
// triangles: gets the new numbers. vertices: how many there are.
SplitVertices split_vertices(std::vector<Triangle>& triangles, const std::vector<Triangle>& attributes, size_t vertices);

// Appends to each of what belongs to the vertices what their copies have.
template <class T>
void append_copies(std::vector<T>& of_vertices, const SplitVertices& split) {
    of_vertices.reserve(of_vertices.size() + split.source.size());
    for (const uint32_t vertex : split.source) of_vertices.push_back(T(of_vertices[vertex]));
}

}  // namespace raypager
