// Binary little-endian PLY files, written as the mesh comes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "base/files.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Vertices are float x, y, z, normals nx, ny, nz if the mesh has any, and u, v if it has coordinates of textures; faces are triangles (list uchar int
// vertex_indices). First all vertices, then all triangles, in pieces of any size; the file appears at commit.
class PlyWriter {
public:
    static Result<PlyWriter> create(const std::filesystem::path& path, uint64_t vertex_count, uint64_t triangle_count, bool has_uvs = false,
                                    bool has_normals = false);
    Status add_vertices(std::span<const Float3> positions);
    // REQUIRES: has_uvs, and one of them for each position; normals likewise if has_normals, else none.
    Status add_vertices(std::span<const Float3> positions, std::span<const Float2> uvs, std::span<const Float3> normals = {});
    Status add_triangles(std::span<const Triangle> triangles);
    // REQUIRES: as many vertices and triangles as were announced.
    Status commit();
    uint64_t bytes() const { return file_.position(); }
    uint64_t triangle_count() const { return triangle_count_; }

private:
    OutputFile file_;
    uint64_t vertices_left_ = 0, triangles_left_ = 0, vertex_count_ = 0, triangle_count_ = 0;
    bool has_uvs_ = false, has_normals_ = false;
};

}  // namespace raypager
