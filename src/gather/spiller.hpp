// Writes the primitives of a scene to disk as they come, when there are too many for memory.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "raypager/scene.hpp"
#include "world/placement.hpp"
#include "world/records.hpp"
#include "world/vertex_table.hpp"

namespace raypager {

class Spiller {
public:
    // The scratch file comes beside the file `beside`.
    static Result<std::unique_ptr<Spiller>> create(const std::filesystem::path& beside, size_t buffer_bytes);

    // Some triangles of a mesh. corners: three each, with positions in object space and attributes as in the world. Triangles that no ray can hit,
    // in either space, are dropped and counted. light: what the others shine like; they become lights then.
    struct Triangles {
        const Shape& shape;
        const PlacedShape& placement;
        std::span<const Triangle> indices;  // for messages
        std::span<const VertexBits> corners;
        VertexAttributes attributes;
    };
    Status add(const Triangles& triangles, const AreaLight* light, std::vector<rp_light>& lights, MeshIssues& issues);
    // With ids of their own. In the end each id must have been given once. bounds: of these spheres.
    Status add(std::span<const SphereRecord> spheres, const Box& bounds);
    // All of a world, in order, so many triangles at a time. REQUIRES: nothing came before.
    Status add(const World& world, size_t at_once);

    uint64_t count() const { return triangles_ + spheres_; }  // the next one's id
    uint64_t triangles() const { return triangles_; }
    uint64_t spheres() const { return spheres_; }
    const Box& bounds() const { return bounds_; }
    Result<Bucket> finish() { return writer_.finish(); }

private:
    Spiller(std::shared_ptr<SpillFile> file, size_t buffer_bytes) : writer_(std::move(file), buffer_bytes) {}
    struct Piece;
    template <class Record>
    class PiecePlacer;
    template <class Record>
    Status add_as(RecordKind kind, const Triangles& triangles, const AreaLight* light, std::vector<rp_light>& lights, MeshIssues& issues);
    // Neighbouring triangles of a world.
    template <class Record>
    Status add_run(RecordKind kind, const World& world, uint32_t first, uint32_t last);

    BucketWriter writer_;
    std::vector<std::byte> records_;  // of the triangles at hand
    uint64_t triangles_ = 0, spheres_ = 0;
    Box bounds_;
};

}  // namespace raypager
