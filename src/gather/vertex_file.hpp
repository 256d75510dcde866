// The vertices of a mesh that is too large for memory.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/files.hpp"
#include "raypager/scene.hpp"
#include "world/vertex_table.hpp"
#include "world/world.hpp"

namespace raypager {

class VertexFile {
public:
    // In the folder of `beside`.
    static Result<VertexFile> create(const std::filesystem::path& beside);
    // attributes: that any vertex has; the same in every call.
    Status append(std::span<const VertexBits> vertices, const VertexAttributes& attributes);
    uint64_t size() const { return count_; }
    // The three corners of each triangle. Every page of the file that holds any of them is read once, in order, whatever the order of the
    // triangles: a scanned mesh, whose triangles use vertices that lie together, reads little more than what it uses.
    // Takes 12 bytes a triangle for the time. REQUIRES: indices of vertices that are there; fewer than 2^30 triangles.
    Status fetch(std::span<const Triangle> triangles, std::span<VertexBits> corners) const;

private:
    std::shared_ptr<SpillFile> file_;
    uint64_t count_ = 0;
    size_t stride_ = 0;  // bytes of a vertex: what no vertex has takes no room
    std::vector<std::byte> packed_;
};

}  // namespace raypager
