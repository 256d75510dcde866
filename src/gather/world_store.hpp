// Puts meshes and spheres into a world.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "raypager/scene.hpp"
#include "world/placement.hpp"
#include "world/world.hpp"

namespace raypager {

class WorldStore {
public:
    // memory: that what is still to come may be given ahead.
    WorldStore(World& world, uint64_t memory) : world_(world), memory_(memory) {}

    static constexpr uint64_t index_limit = RP_NONE;  // of primitives and vertices

    uint64_t count() const { return world_.primitives.size(); }

    // What the world takes when so many bytes of meshes come: while an array moves to where there is room for them, or when all is cut.
    uint64_t memory_bytes(uint64_t more) const;
    // What comes on top if that has coordinates of textures.
    uint64_t uv_memory_bytes() const { return (world_.positions.size() - world_.uvs.size()) * sizeof(Float2); }
    // Whether vertices of a mesh of so many bytes can be numbered besides those that are there.
    bool can_number(uint64_t mesh_bytes) const { return world_.positions.size() + mesh_bytes / min_vertex_bytes < index_limit; }

    // share: of all meshes, what will be there with this one, by their bytes; 1 where that is unknown.
    Status add(const Shape& shape, const PlacedShape& placement, TriangleMesh& mesh, MeshIssues& issues, double share);

    void add(const WorldSphere& sphere) { add(std::span(&sphere, 1)); }
    // By all threads.
    void add(std::span<const WorldSphere> spheres);

private:
    // How many items there will be at the end. Memory that nobody writes to costs nothing; moving what is there, again and again, does.
    size_t expected(size_t count, size_t item_bytes, double share) const;

    void place_positions(const PlacedShape& placement, const TriangleMesh& mesh);

    // Only vertices that triangles use count: those of dropped triangles may be anything.
    Status check_range(const Shape& shape, const TriangleMesh& mesh, uint64_t base) const;

    void place_normals(const PlacedShape& placement, const TriangleMesh& mesh, uint64_t base);

    void place_colors(const TriangleMesh& mesh, uint64_t base);

    void place_uvs(const TriangleMesh& mesh, uint64_t base);

    // Makes vertices one that are alike in every bit. Blocks do so in any case, but here it saves memory, and how many bytes a triangle
    // will take is estimated by who shares its vertices.
    void weld(TriangleMesh& mesh, uint64_t base);

    // Bounds are those of the triangles: a mesh may have vertices that none of them uses.
    void place_triangles(const PlacedShape& placement, TriangleMesh& mesh, uint32_t base, MeshIssues& issues, double share);

    static constexpr uint64_t min_vertex_bytes = 20;  // of a mesh in memory (mesh_intake.cpp)

    World& world_;
    const uint64_t memory_;
    std::atomic<bool> all_in_range_{true};  // vertices of the mesh at hand
};

}  // namespace raypager
