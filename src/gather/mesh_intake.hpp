// Takes a mesh from its source: as a whole while it fits into memory, else in chunks, with its vertices on disk.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "gather/vertex_file.hpp"
#include "raypager/scene.hpp"
#include "world/placement.hpp"

namespace raypager {

class MeshIntake final : public MeshSink {
public:
    struct Hooks {
        // Whether a mesh that takes so many bytes may stay in memory. Asked again and again while it grows.
        std::function<Result<bool>(uint64_t bytes)> fits;
        // Takes a chunk; corners as Spiller has them.
        std::function<Status(std::span<const Triangle> indices, std::span<const VertexBits> corners, const VertexAttributes& attributes)> take;
        std::filesystem::path beside;                   // where the vertices go
        size_t chunk = 0;                               // triangles
        std::function<void(double fraction)> progress;  // of a mesh that is taken in chunks
        bool colors = true, uvs = true;                 // of vertices are wanted
        uint64_t buffer_bytes = 0;                      // that the source may take beside, while the mesh is in memory
    };
    MeshIntake(const PlacedShape& placement, MeshIssues& issues, Hooks hooks) : placement_(placement), issues_(issues), hooks_(std::move(hooks)) {}

    Status expect(uint64_t vertices, uint64_t triangles) override;
    uint64_t buffer_bytes() const override { return file_ ? 0 : hooks_.buffer_bytes; }
    bool wants_uvs() const override { return hooks_.uvs; }
    Status vertices(const MeshVertices& vertices) override;
    Status triangles(std::span<const Triangle> indices) override;
    // At the end of the stream: hands on the last chunk.
    Status finish();
    // After finish(): the mesh as it came, if it is in memory; then no chunk was handed on.
    bool whole() const { return !file_; }
    TriangleMesh& mesh() { return mesh_; }
    uint64_t vertices() const { return file_ ? file_->size() : mesh_.positions.size(); }
    const VertexAttributes& attributes() const { return attributes_; }

    // Bytes that a mesh takes in memory while it is looked at.
    static uint64_t memory_bytes(uint64_t vertices, uint64_t triangles, const VertexAttributes& attributes);

private:
    Result<bool> stays(uint64_t more_vertices, uint64_t more_triangles);
    Status move_to_file();
    Status append_to_file(const MeshVertices& vertices);
    Status take_chunk();

    const PlacedShape& placement_;
    MeshIssues& issues_;
    Hooks hooks_;
    TriangleMesh mesh_;  // all of it, or the triangles of the chunk at hand
    std::optional<VertexFile> file_;
    std::vector<VertexBits> corners_;
    uint64_t expected_vertices_ = 0, expected_triangles_ = 0, triangles_seen_ = 0;
    VertexAttributes attributes_;
};

}  // namespace raypager
