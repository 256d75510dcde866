#include "gather/gather.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "block/point_code.hpp"
#include "clouds/cloud_stream.hpp"
#include "gather/lights.hpp"
#include "gather/mesh_intake.hpp"
#include "gather/mesh_prefetch.hpp"
#include "gather/spiller.hpp"
#include "gather/world_store.hpp"
#include "scene/check_material.hpp"
#include "scene/clean_mesh.hpp"
#include "scene/texture_use.hpp"
#include "world/placement.hpp"

namespace raypager {
namespace {

constexpr uint64_t index_limit = WorldStore::index_limit;
constexpr uint64_t prefetch_share = 4;  // of the limit for meshes that are read ahead
constexpr uint64_t buffer_share = 32;   // and for reading one that is not
constexpr size_t piece_items = size_t{1} << 16;

class Gatherer {
public:
    Gatherer(const Scene& scene, const GatherLimits& limits, const GatherProgress& progress, const PointOptions& points, float position_cell,
             Gathered& out)
        : scene_(scene),
          limits_(limits),
          progress_(progress),
          points_(points),
          position_cell_(position_cell),
          out_(out),
          prefetch_(scene, limits.memory.gather / prefetch_share, limits.stop),
          buffer_(limits.memory.gather / buffer_share),
          room_(limits.memory.gather - limits.memory.gather / prefetch_share - buffer_),
          store_(out.world, room_) {
        for (const Shape& shape : scene.shapes) bytes_ += mesh_bytes(shape);
    }

    Status add(size_t index) {
        const Shape& shape = scene_.shapes[index];
        index_ = index;
        bytes_begun_ += mesh_bytes(shape);
        if (shape.backdrop && out_.bounds.empty()) out_.bounds = spiller_ ? spiller_->bounds() : out_.world.bounds;
        const uint64_t first = count();
        const auto first_light = static_cast<uint32_t>(out_.lights.size());
        light_ = nullptr;
        vertices_have_ = {};
        wants_uvs_ = wants_uvs(scene_, shape);
        if (shape.area_light && !is_black(scene_.area_lights[*shape.area_light])) light_ = &scene_.area_lights[*shape.area_light];
        if (shape.unseen) return light_ ? add_unseen_lights(shape, *light_, unseen_, out_.issues) : Status();
        RAYPAGER_TRY(shape.mesh ? add_mesh(shape, prefetch_.take(index)) : shape.points ? add_points(shape) : add_sphere(shape));
        if (count() >= index_limit || out_.world.positions.size() >= index_limit) return too_many(shape);
        if (count() > first) add_range(shape, static_cast<uint32_t>(first), first_light);
        report(1);
        return {};
    }

    Status finish() {
        if (spiller_) {
            out_.world.bounds = spiller_->bounds();
            out_.triangles = spiller_->triangles();
            out_.spheres = spiller_->spheres();
            out_.weight += out_.spheres * sphere_weight;
            auto spilled = spiller_->finish();
            if (!spilled) return spilled.status();
            out_.spilled = std::move(*spilled);
        } else {
            out_.spheres = out_.world.spheres.size();
            out_.triangles = out_.world.primitives.size() - out_.spheres;
        }
        for (const auto* others : {&std::as_const(unseen_), &scene_.lights}) out_.lights.insert(out_.lights.end(), others->begin(), others->end());
        if (out_.bounds.empty()) out_.bounds = out_.world.bounds;
        const Box& bounds = out_.bounds;
        set_probabilities(out_.lights, bounds.empty() ? radius_of_nothing : radius_of(bounds.lower, bounds.upper));
        return {};
    }

private:
    // fraction: of the shape at hand.
    void report(double fraction) const {
        progress_(spiller_ ? "stream" : "load", (static_cast<double>(index_) + fraction) / static_cast<double>(scene_.shapes.size()));
    }
    static uint64_t mesh_bytes(const Shape& shape) { return shape.mesh ? shape.mesh->bytes_to_read() : 0; }
    static Status too_many(const Shape& shape) {
        return Status::failed(
            fmt::format("{}: the scene has more than {} primitives or vertices with it; leave some shapes out", shape.name, index_limit - 1));
    }
    uint64_t count() const { return spiller_ ? spiller_->count() : store_.count(); }
    static VertexAttributes attributes_of(const TriangleMesh& mesh) { return {!mesh.normals.empty(), !mesh.colors.empty(), !mesh.uvs.empty()}; }

    Status add_mesh(const Shape& shape, std::optional<MeshPrefetch::Loaded> loaded) {
        if (!loaded) return stream_mesh(shape);
        RAYPAGER_TRY(loaded->status);
        TriangleMesh& mesh = loaded->mesh;
        if (!shape.vertex_colors) mesh.colors = {};
        const VertexAttributes attributes = attributes_of(mesh);
        const auto room = fits(MeshIntake::memory_bytes(mesh.positions.size(), mesh.triangles.size(), attributes));
        if (!room) return room.status();
        const uint64_t first = count();
        RAYPAGER_TRY(add_whole(shape, PlacedShape(shape, position_cell_), mesh, loaded->issues));
        if (spiller_) add_weight(count() - first, mesh.positions.size(), attributes);
        vertices_have_ = attributes;
        out_.issues.add(loaded->issues);
        return {};
    }

    Status stream_mesh(const Shape& shape) {
        MeshIssues issues;
        const PlacedShape placement(shape, position_cell_);
        MeshIntake intake(placement, issues,
                          {[this](uint64_t bytes) { return fits(bytes); },
                           [&](std::span<const Triangle> indices, std::span<const VertexBits> corners, const VertexAttributes& attributes) {
                               return spill({shape, placement, indices, corners, attributes}, issues);
                           },
                           limits_.spill_beside, limits_.memory.chunk_triangles, [this](double fraction) { report(fraction); }, shape.vertex_colors,
                           wants_uvs_, buffer_});
        const uint64_t first = count();
        RAYPAGER_TRY(shape.mesh->stream(intake, issues));
        RAYPAGER_TRY(intake.finish());
        if (intake.whole()) {
            clean_mesh(intake.mesh(), issues);
            RAYPAGER_TRY(add_whole(shape, placement, intake.mesh(), issues));
        } else {
            issues.not_compared += count() - first;
        }
        if (spiller_) add_weight(count() - first, intake.vertices(), intake.attributes());
        vertices_have_ = intake.attributes();
        out_.issues.add(issues);
        return {};
    }

    // Whether a mesh of so many bytes may stay in memory. For its sake the world may have to leave it.
    Result<bool> fits(uint64_t mesh_bytes) {
        if (limits_.stop && *limits_.stop) return Status::interrupted("stopped by a signal; nothing was written");
        const uint64_t in_world = store_.memory_bytes(mesh_bytes) + (wants_uvs_ ? store_.uv_memory_bytes() : 0);
        if (!spiller_ && mesh_bytes + in_world <= room_ && store_.can_number(mesh_bytes)) return true;
        if (!spiller_) RAYPAGER_TRY(begin_spilling());
        return mesh_bytes <= room_ / 2;
    }

    Status begin_spilling() {
        auto spiller = Spiller::create(limits_.spill_beside, limits_.memory.buffers / 8);
        if (!spiller) return spiller.status();
        RAYPAGER_TRY((*spiller)->add(out_.world, limits_.memory.chunk_triangles));
        spiller_ = std::move(*spiller);
        add_weight(spiller_->triangles(), out_.world.positions.size(), out_.world.attributes());
        out_.world = {};
        return {};
    }

    Status add_whole(const Shape& shape, const PlacedShape& placement, TriangleMesh& mesh, MeshIssues& issues) {
        if (out_.world.positions.size() + mesh.positions.size() >= index_limit || count() + mesh.triangles.size() >= index_limit)
            return too_many(shape);
        if (spiller_) return spill_whole(shape, placement, mesh, issues);
        const auto first = static_cast<uint32_t>(count());
        const double share = mesh_bytes(shape) > 0 ? static_cast<double>(bytes_begun_) / static_cast<double>(bytes_) : 1;
        RAYPAGER_TRY(store_.add(shape, placement, mesh, issues, share));
        if (light_)
            for (uint32_t i = first; i < count(); i++) out_.lights.push_back(primitive_light(out_.world, i, *light_));
        return {};
    }

    Status spill_whole(const Shape& shape, const PlacedShape& placement, const TriangleMesh& mesh, MeshIssues& issues) {
        const VertexAttributes attributes = attributes_of(mesh);
        std::vector<VertexBits> corners;
        for (size_t first = 0; first < mesh.triangles.size(); first += limits_.memory.chunk_triangles) {
            const auto indices = std::span(mesh.triangles).subspan(first, std::min(limits_.memory.chunk_triangles, mesh.triangles.size() - first));
            corners.resize(3 * indices.size());
            parallel_for(indices.size(), piece_items, [&](size_t begin, size_t end) {
                for (size_t i = 3 * begin; i < 3 * end; i++) {
                    const uint32_t v = indices[i / 3][i % 3];
                    corners[i] = {mesh.positions[v], attributes.normals ? placement.normal(mesh.normals[v]) : RP_NONE,
                                  attributes.colors ? point_color_code(mesh.colors[v]) : RP_NONE, attributes.uvs ? mesh.uvs[v] : Float2{}};
                }
            });
            RAYPAGER_TRY(spill({shape, placement, indices, corners, attributes}, issues));
        }
        return {};
    }

    Status spill(const Spiller::Triangles& triangles, MeshIssues& issues) {
        if (spiller_->count() + triangles.indices.size() >= index_limit) return too_many(triangles.shape);
        return spiller_->add(triangles, light_, out_.lights, issues);
    }

    void add_weight(uint64_t triangles, uint64_t vertices, const VertexAttributes& attributes) {
        if (triangles == 0) return;
        const float own = static_cast<float>(static_cast<double>(vertices) / static_cast<double>(triangles));
        out_.weight += triangles * triangle_weight(std::clamp(own, 0.5f, 3.0f), attributes);
    }

    Status add_sphere(const Shape& shape) {
        const auto sphere = place_sphere(shape);
        if (!sphere) return sphere.status();
        if (!*sphere) {
            out_.issues.degenerate++;
            return {};
        }
        return push_sphere(**sphere);
    }

    Status add_points(const Shape& shape) {
        const PointRules rules(shape, scene_, points_);
        const auto room = fits(shape.points->count() * placed_cloud_memory);
        if (!room) return room.status();
        if (!*room) return stream_points(shape, rules);
        auto cloud = place_cloud(shape, rules, out_.issues);
        if (!cloud) return cloud.status();
        RAYPAGER_TRY(push_spheres(cloud->spheres));
        out_.points_culled += cloud->culled;
        out_.points_merged += cloud->merged;
        return {};
    }

    Status stream_points(const Shape& shape, const PointRules& rules) {
        const uint64_t first = count();
        const size_t first_light = out_.lights.size();
        const auto take = [&](std::span<SphereRecord> spheres, const Box& bounds) -> Status {
            for (auto& [sphere, id] : spheres) {
                const uint32_t rank = id;
                if (first + rank >= index_limit) return too_many(shape);
                id += static_cast<uint32_t>(first);
                if (!light_) continue;
                out_.lights.resize(std::max(out_.lights.size(), first_light + rank + 1));
                out_.lights[first_light + rank] = sphere_light(sphere, *light_);
            }
            return spiller_->add(spheres, bounds);
        };
        const auto cloud = stream_cloud(
            shape, rules, {limits_.memory, limits_.spill_beside, limits_.stop, take, [this](double fraction) { report(fraction); }}, out_.issues);
        if (!cloud) return cloud.status();
        out_.points_culled += cloud->culled;
        out_.points_merged += cloud->merged;
        return {};
    }

    Status push_sphere(const WorldSphere& sphere) {
        const auto room = fits(0);
        if (!room) return room.status();
        return push_spheres(std::span(&sphere, 1));
    }

    // There is room for them.
    Status push_spheres(std::span<const WorldSphere> spheres) {
        if (light_)
            for (const WorldSphere& sphere : spheres) out_.lights.push_back(sphere_light(sphere, *light_));
        if (!spiller_) return store_.add(spheres), Status();
        std::vector<SphereRecord> records;
        auto id = static_cast<uint32_t>(count());
        for (const WorldSphere& sphere : spheres) records.push_back({sphere, id++});
        return spiller_->add(records, bounds_of(records));
    }

    // Shapes of the same material that do not shine share a range.
    void add_range(const Shape& shape, uint32_t first, uint32_t first_light) {
        rp_u32 flags = shape.points && shape.points->has_color() ? RP_RANGE_POINT_COLOR : 0;
        flags |= (vertices_have_.colors ? RP_RANGE_VERTEX_COLOR : 0) | (vertices_have_.uvs ? RP_RANGE_UV : 0);
        if (may_be_nothing(scene_.materials, shape.material)) flags |= RP_RANGE_CUTOUT;
        if (light_) flags |= std::min(*shape.area_light, RP_RANGE_AREA_LIGHTS) << RP_RANGE_AREA_LIGHT_SHIFT;
        const rp_primitive_range range = {first, shape.material, light_ ? first_light : RP_NONE, flags};
        const bool merge = !out_.ranges.empty() && out_.ranges.back().material == range.material && out_.ranges.back().flags == range.flags &&
                           out_.ranges.back().first_light == RP_NONE && range.first_light == RP_NONE;
        if (!merge) out_.ranges.push_back(range);
    }

    const Scene& scene_;
    const GatherLimits& limits_;
    const GatherProgress& progress_;
    const PointOptions& points_;
    const float position_cell_;
    Gathered& out_;
    MeshPrefetch prefetch_;
    const uint64_t buffer_;             // for reading a mesh that was not read ahead
    const uint64_t room_;               // for the world and the mesh at hand
    WorldStore store_;                  // until there is too much,
    std::unique_ptr<Spiller> spiller_;  // and from then on
    uint64_t bytes_ = 0;                // of all meshes
    uint64_t bytes_begun_ = 0;          // of the meshes up to the one at hand
    size_t index_ = 0;                  // of the shape at hand
    const AreaLight* light_ = nullptr;  // that shape's, if it shines
    VertexAttributes vertices_have_;    // of that shape
    bool wants_uvs_ = false;            // that shape has a use for coordinates of textures
    std::vector<rp_light> unseen_;
};

}  // namespace

Result<Gathered> gather(const Scene& scene, const GatherLimits& limits, const GatherProgress& progress, const PointOptions& points,
                        float position_cell) {
    Gathered gathered;
    Gatherer gatherer(scene, limits, progress, points, position_cell, gathered);
    for (size_t i = 0; i < scene.shapes.size(); i++)
        if (auto status = gatherer.add(i); !status.ok()) return status;
    if (auto status = gatherer.finish(); !status.ok()) return status;
    return gathered;
}

Result<Gathered> gather(const Scene& scene, const std::function<void(double)>& progress, const PointOptions& points) {
    return gather(
        scene, GatherLimits(), [&progress](const char*, double fraction) { progress(fraction); }, points);
}

}  // namespace raypager
