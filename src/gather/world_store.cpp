#include "gather/world_store.hpp"

#include <algorithm>
#include <mutex>
#include <span>
#include <vector>

#include "base/huge_pages.hpp"
#include "base/parallel.hpp"
#include "block/point_code.hpp"
#include "world/vertex_table.hpp"

namespace raypager {
namespace {

// A mesh with more vertices per triangle than this shares few of them: a closed one has a half, a list of triangles three.
constexpr uint64_t own_vertices_of_a_soup = 1;
constexpr size_t items_at_once = size_t{1} << 16;

}  // namespace

uint64_t WorldStore::memory_bytes(uint64_t more) const {
    const auto bytes = [](const auto& array) { return array.size() * sizeof array[0]; };
    const auto moved = [&](const auto& array) { return (array.capacity() - array.size()) * sizeof array[0] <= more ? bytes(array) : 0; };
    const auto& [positions, normals, colors, uvs, primitives, spheres, instances, ids, first_id, bounds] = world_;
    // Of a vertex: its normal, which may be still to come, and how many triangles share it.
    const uint64_t others = positions.size() * (sizeof normals[0] + 1) + bytes(colors) + bytes(uvs);
    return bytes(positions) + others + bytes(primitives) + bytes(spheres) +
           std::max({moved(positions), moved(normals), moved(colors), moved(uvs), moved(primitives), moved(spheres), primitives.size() * cut_memory});
}

Status WorldStore::add(const Shape& shape, const PlacedShape& placement, TriangleMesh& mesh, MeshIssues& issues, double share) {
    const auto base = static_cast<uint64_t>(world_.positions.size());
    grow_huge(world_.positions, base + mesh.positions.size(), expected(base + mesh.positions.size(), sizeof(Float3), share));
    place_positions(placement, mesh);
    place_normals(placement, mesh, base);
    place_colors(mesh, base);
    place_uvs(mesh, base);
    RAYPAGER_TRY(check_range(shape, mesh, base));
    if (mesh.positions.size() > own_vertices_of_a_soup * mesh.triangles.size()) weld(mesh, base);
    place_triangles(placement, mesh, static_cast<uint32_t>(base), issues, share);
    return {};
}

void WorldStore::add(std::span<const WorldSphere> spheres) {
    const size_t first_sphere = world_.spheres.size(), first = world_.primitives.size();
    grow_huge(world_.spheres, first_sphere + spheres.size());
    grow_huge(world_.primitives, first + spheres.size());
    world_.spheres.resize(first_sphere + spheres.size());
    world_.primitives.resize(first + spheres.size());
    std::mutex mutex;
    parallel_for(spheres.size(), items_at_once, [&](size_t begin, size_t end) {
        Box bounds;
        for (size_t i = begin; i < end; i++) {
            world_.spheres[first_sphere + i] = spheres[i];
            world_.primitives[first + i] = World::sphere_entry(first_sphere + i);
            bounds.grow(sphere_bounds(spheres[i]));
        }
        const std::lock_guard lock(mutex);
        world_.bounds.grow(bounds);
    });
}

size_t WorldStore::expected(size_t count, size_t item_bytes, double share) const {
    constexpr double reserve = 1.5;         // triangles a byte differ from mesh to mesh
    constexpr double min_share = 1.0 / 64;  // less says little of all the others
    const double most = static_cast<double>(memory_) / 3 / static_cast<double>(item_bytes);
    return static_cast<size_t>(std::min(static_cast<double>(count) / std::max(share, min_share) * reserve, most));
}

void WorldStore::place_positions(const PlacedShape& placement, const TriangleMesh& mesh) {
    const size_t base = world_.positions.size();
    world_.positions.resize(base + mesh.positions.size());
    all_in_range_ = true;
    parallel_for(mesh.positions.size(), items_at_once, [&](size_t begin, size_t end) {
        const auto placed = std::span(world_.positions).subspan(base + begin, end - begin);
        if (placement.keeps_positions())
            std::copy_n(&mesh.positions[begin], placed.size(), placed.begin());
        else
            for (size_t i = begin; i < end; i++) placed[i - begin] = placement.point(mesh.positions[i]);
        bool in = true;
        for (const Float3& p : placed) in &= in_range(p);
        if (!in) all_in_range_ = false;
    });
}

Status WorldStore::check_range(const Shape& shape, const TriangleMesh& mesh, uint64_t base) const {
    if (all_in_range_) return {};
    std::atomic<size_t> outside{SIZE_MAX};
    parallel_for(mesh.triangles.size(), items_at_once, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            for (const uint32_t v : mesh.triangles[i])
                if (!in_range(world_.positions[base + v])) outside = v;
    });
    return outside == SIZE_MAX ? Status() : out_of_range(shape, outside, world_.positions[base + outside]);
}

void WorldStore::place_normals(const PlacedShape& placement, const TriangleMesh& mesh, uint64_t base) {
    if (mesh.normals.empty() && world_.normals.empty()) return;
    world_.normals.resize(world_.positions.size(), RP_NONE);
    parallel_for(mesh.normals.size(), items_at_once, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) world_.normals[base + i] = placement.normal(mesh.normals[i]);
    });
}

void WorldStore::place_colors(const TriangleMesh& mesh, uint64_t base) {
    if (mesh.colors.empty() && world_.colors.empty()) return;
    world_.colors.resize(world_.positions.size(), RP_NONE);
    parallel_for(mesh.colors.size(), items_at_once, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) world_.colors[base + i] = point_color_code(mesh.colors[i]);
    });
}

void WorldStore::place_uvs(const TriangleMesh& mesh, uint64_t base) {
    if (mesh.uvs.empty()) return;
    world_.uvs.resize(world_.positions.size());
    std::copy(mesh.uvs.begin(), mesh.uvs.end(), world_.uvs.begin() + static_cast<ptrdiff_t>(base));
}

void WorldStore::weld(TriangleMesh& mesh, uint64_t base) {
    VertexTable table(mesh.triangles.size());
    for (Triangle& t : mesh.triangles)
        for (uint32_t& v : t) v = table.number(world_.vertex(static_cast<uint32_t>(base) + v));
    world_.positions.resize(base + table.size());
    if (!world_.normals.empty()) world_.normals.resize(world_.positions.size());
    if (!world_.colors.empty()) world_.colors.resize(world_.positions.size());
    const bool uvs = world_.uvs.size() > base;
    if (uvs) world_.uvs.resize(world_.positions.size());
    for (size_t i = 0; i < table.size(); i++) {
        const VertexBits vertex = table[i];
        world_.positions[base + i] = vertex.position;
        if (!world_.normals.empty()) world_.normals[base + i] = vertex.normal;
        if (!world_.colors.empty()) world_.colors[base + i] = vertex.color;
        if (uvs) world_.uvs[base + i] = vertex.uv;
    }
}

void WorldStore::place_triangles(const PlacedShape& placement, TriangleMesh& mesh, uint32_t base, MeshIssues& issues, double share) {
    struct Piece {
        size_t kept = 0;  // that many lie at its front
        Box bounds;
    };
    std::vector<Piece> pieces((mesh.triangles.size() + items_at_once - 1) / items_at_once);
    const bool flip = placement.flips();
    parallel_for(mesh.triangles.size(), items_at_once, [&](size_t begin, size_t end) {
        size_t kept = begin;
        Box4 bounds;
        for (size_t i = begin; i < end; i++) {
            Triangle t = mesh.triangles[i];
            t = {base + t[0], base + t[flip ? 2 : 1], base + t[flip ? 1 : 2]};
            const Float3 &a = world_.positions[t[0]], &b = world_.positions[t[1]], &c = world_.positions[t[2]];
            // Those without an area where they came from are gone already.
            if (!placement.keeps_positions() && has_no_area(a, b, c)) continue;
            for (const Float3& p : {a, b, c}) bounds.grow(Float4{p.x, p.y, p.z, 0});
            mesh.triangles[kept++] = t;
        }
        pieces[begin / items_at_once] = {kept - begin, bounds.box()};
    });
    size_t count = 0;
    for (const Piece& part : pieces) count += part.kept;
    // What is kept of the only mesh so far stays where it is, if that is most of it.
    const bool only = world_.primitives.empty() && count >= mesh.triangles.capacity() / 8 * 7;
    const size_t all_kept = world_.primitives.size() + count;
    if (!only) grow_huge(world_.primitives, all_kept, expected(all_kept, sizeof(Triangle), share));
    size_t place = 0;
    for (size_t i = 0; i < pieces.size(); i++) {
        const auto all = std::span(mesh.triangles).subspan(i * items_at_once), kept = all.first(pieces[i].kept);
        issues.degenerate += std::min(items_at_once, all.size()) - kept.size();
        if (!only)
            world_.primitives.insert(world_.primitives.end(), kept.begin(), kept.end());
        else if (place != i * items_at_once)
            std::copy(kept.begin(), kept.end(), mesh.triangles.begin() + static_cast<ptrdiff_t>(place));
        place += kept.size();
        world_.bounds.grow(pieces[i].bounds);
    }
    if (!only) return;
    mesh.triangles.resize(place);
    world_.primitives = std::move(mesh.triangles);
}

}  // namespace raypager
