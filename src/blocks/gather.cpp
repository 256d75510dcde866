#include "blocks/gather.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cmath>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "blocks/lights.hpp"
#include "blocks/octahedral.hpp"

namespace raypager {
namespace {

// The triangle test multiplies three distances in single precision, and that must stay finite.
constexpr double largest_coordinate = 1e12;
// A mesh with more vertices a triangle than this shares few of them: a closed one has a half, a list of triangles three.
constexpr uint64_t own_vertices_of_a_soup = 1;
constexpr uint64_t index_limit = RP_NONE;

bool is_black(const AreaLight& light) { return light.radiance.x == 0 && light.radiance.y == 0 && light.radiance.z == 0; }

bool in_range(const Float3& p) {
    return std::abs(p.x) <= largest_coordinate && std::abs(p.y) <= largest_coordinate && std::abs(p.z) <= largest_coordinate;
}

Float3 rounded(const std::array<double, 3>& p) { return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}; }

// Whether the triangle has no area. Differences of floats are exact in double precision unless their magnitudes are far apart.
bool has_no_area(const Float3& a, const Float3& b, const Float3& c) {
    const double ux = double(b.x) - a.x, uy = double(b.y) - a.y, uz = double(b.z) - a.z;
    const double vx = double(c.x) - a.x, vy = double(c.y) - a.y, vz = double(c.z) - a.z;
    return uy * vz == uz * vy && uz * vx == ux * vz && ux * vy == uy * vx;
}

class Gatherer {
public:
    Gatherer(const Scene& scene, const PointOptions& points, Gathered& out) : scene_(scene), points_(points), out_(out), world_(out.world) {}

    Status add(const Shape& shape) {
        const auto first = static_cast<uint32_t>(world_.primitives.size());
        RAYPAGER_TRY(shape.mesh ? add_mesh(shape) : shape.points ? add_points(shape) : add_sphere(shape));
        if (world_.primitives.size() >= index_limit || world_.positions.size() >= index_limit)
            return Status::failed(
                fmt::format("{}: the scene has more than {} primitives or vertices with it; leave some shapes out", shape.name, index_limit - 1));
        if (world_.primitives.size() > first) add_range(shape, first);
        return {};
    }

    void finish() {
        // Of the primitives: meshes may have vertices that none of them uses.
        for (uint32_t i = 0; i < world_.primitives.size(); i++) world_.bounds.grow(primitive_bounds(world_, i));
        out_.lights.insert(out_.lights.end(), scene_.lights.begin(), scene_.lights.end());
        double radius = 1;
        if (const Box& b = world_.bounds; !b.empty())
            radius = 0.5 * std::hypot(double(b.upper[0]) - b.lower[0], double(b.upper[1]) - b.lower[1], double(b.upper[2]) - b.lower[2]);
        set_probabilities(out_.lights, radius);
    }

private:
    Status add_mesh(const Shape& shape) {
        MeshIssues issues;
        RAYPAGER_TRY(shape.mesh->load(mesh_, issues));
        drop_bad_indices(issues);
        const auto base = static_cast<uint64_t>(world_.positions.size());
        if (base + mesh_.positions.size() >= index_limit || world_.primitives.size() + mesh_.triangles.size() >= index_limit)
            return Status::failed(
                fmt::format("{}: the scene has more than {} primitives or vertices with it; leave some shapes out", shape.name, index_limit - 1));
        RAYPAGER_CHECK(mesh_.normals.empty() || mesh_.normals.size() == mesh_.positions.size());
        place_positions(shape);
        RAYPAGER_TRY(check_range(shape, base));
        place_normals(shape, base);
        if (mesh_.positions.size() > own_vertices_of_a_soup * mesh_.triangles.size()) weld(base);
        place_triangles(shape, static_cast<uint32_t>(base), issues);
        out_.issues.add(issues);
        return {};
    }

    void drop_bad_indices(MeshIssues& issues) {
        const size_t count = mesh_.positions.size();
        issues.bad_index += std::erase_if(mesh_.triangles, [count](const Triangle& t) { return t[0] >= count || t[1] >= count || t[2] >= count; });
    }

    void place_positions(const Shape& shape) {
        const size_t base = world_.positions.size();
        world_.positions.resize(base + mesh_.positions.size());
        const bool identity = shape.to_world.is_identity();
        parallel_for(mesh_.positions.size(), size_t{1} << 16, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                const Float3& p = mesh_.positions[i];
                world_.positions[base + i] = identity ? p : rounded(shape.to_world.point(p.x, p.y, p.z));
            }
        });
    }

    // Only vertices that triangles use count: those of dropped triangles may be anything.
    Status check_range(const Shape& shape, uint64_t base) const {
        std::atomic<size_t> outside{SIZE_MAX};
        parallel_for(mesh_.triangles.size(), size_t{1} << 16, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                for (const uint32_t v : mesh_.triangles[i])
                    if (!in_range(world_.positions[base + v])) outside = v;
        });
        if (outside == SIZE_MAX) return {};
        const Float3& p = world_.positions[base + outside];
        return Status::failed(
            fmt::format("{}: vertex {} lies at ({}, {}, {}) in the world; coordinates up to {} are supported: scale the scene, or remove it",
                        shape.name, outside.load(), p.x, p.y, p.z, largest_coordinate));
    }

    // Normals go with the inverse transpose. Which side a shading normal points to is looked at only where it is used.
    void place_normals(const Shape& shape, uint64_t base) {
        if (mesh_.normals.empty() && world_.normals.empty()) return;
        world_.normals.resize(world_.positions.size(), RP_NONE);
        const auto inverse = shape.to_world.inverse();
        if (mesh_.normals.empty() || !inverse) return;
        const Transform to_world = inverse->transpose();
        parallel_for(mesh_.normals.size(), size_t{1} << 16, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                const Float3& n = mesh_.normals[i];
                const auto placed = to_world.vector(n.x, n.y, n.z);
                world_.normals[base + i] = encode_octahedral(placed[0], placed[1], placed[2]);
            }
        });
    }

    // Makes vertices one that are alike in every bit. Blocks do so in any case, but here it saves memory, and how many bytes a triangle
    // will take is estimated by who shares its vertices.
    void weld(uint64_t base) {
        VertexTable table(mesh_.triangles.size());
        for (Triangle& t : mesh_.triangles)
            for (uint32_t& v : t) v = table.number(world_.vertex(static_cast<uint32_t>(base) + v));
        const auto& vertices = table.vertices();
        world_.positions.resize(base + vertices.size());
        if (!world_.normals.empty()) world_.normals.resize(world_.positions.size());
        for (size_t i = 0; i < vertices.size(); i++) {
            world_.positions[base + i] = vertices[i].position;
            if (!world_.normals.empty()) world_.normals[base + i] = vertices[i].normal;
        }
    }

    void place_triangles(const Shape& shape, uint32_t base, MeshIssues& issues) {
        const bool flip = shape.reverse_orientation != shape.to_world.swaps_handedness();
        for (Triangle t : mesh_.triangles) {
            t = {base + t[0], base + t[flip ? 2 : 1], base + t[flip ? 1 : 2]};
            if (has_no_area(world_.positions[t[0]], world_.positions[t[1]], world_.positions[t[2]])) {
                issues.degenerate++;
                continue;
            }
            world_.primitives.push_back(t);
        }
    }

    Status add_sphere(const Shape& shape) {
        const SpherePrimitive& s = shape.sphere;
        const auto center = shape.to_world.point(s.center.x, s.center.y, s.center.z);
        const auto x = shape.to_world.vector(1, 0, 0), y = shape.to_world.vector(0, 1, 0), z = shape.to_world.vector(0, 0, 1);
        const double lengths[3] = {std::hypot(x[0], x[1], x[2]), std::hypot(y[0], y[1], y[2]), std::hypot(z[0], z[1], z[2])};
        const double longest = std::max({lengths[0], lengths[1], lengths[2]}), shortest = std::min({lengths[0], lengths[1], lengths[2]});
        if (longest - shortest > 1e-3 * longest)
            return Status::failed(fmt::format("{}: a sphere scaled unevenly is an ellipsoid, which is not supported; use a mesh", shape.name));
        const WorldSphere sphere = {rounded(center), static_cast<float>(s.radius * (lengths[0] + lengths[1] + lengths[2]) / 3)};
        if (!in_range(sphere.center) || !(std::abs(sphere.radius) <= largest_coordinate))
            return Status::failed(fmt::format("{}: the sphere reaches beyond {}, the largest supported coordinate; scale the scene, or remove it",
                                              shape.name, largest_coordinate));
        if (!(sphere.radius > 0)) {
            out_.issues.degenerate++;
            return {};
        }
        push_sphere(sphere);
        return {};
    }

    Status add_points(const Shape& shape) {
        auto cloud = place_cloud(shape, scene_, points_, largest_coordinate, out_.issues);
        if (!cloud) return cloud.status();
        for (const WorldSphere& sphere : cloud->spheres) push_sphere(sphere);
        out_.points_culled += cloud->culled;
        out_.points_merged += cloud->merged;
        return {};
    }

    void push_sphere(const WorldSphere& sphere) {
        world_.primitives.push_back({static_cast<uint32_t>(world_.spheres.size()), RP_NONE, RP_NONE});
        world_.spheres.push_back(sphere);
    }

    // Shapes of the same material that do not shine share a range.
    void add_range(const Shape& shape, uint32_t first) {
        rp_primitive_range range = {first, shape.material, RP_NONE, shape.points && shape.points->has_color() ? RP_RANGE_POINT_COLOR : 0};
        if (shape.area_light && !is_black(scene_.area_lights[*shape.area_light])) {
            range.first_light = static_cast<uint32_t>(out_.lights.size());
            for (uint32_t i = first; i < world_.primitives.size(); i++)
                out_.lights.push_back(primitive_light(world_, i, scene_.area_lights[*shape.area_light]));
        }
        const bool merge = !out_.ranges.empty() && out_.ranges.back().material == range.material && out_.ranges.back().flags == range.flags &&
                           out_.ranges.back().first_light == RP_NONE && range.first_light == RP_NONE;
        if (!merge) out_.ranges.push_back(range);
    }

    const Scene& scene_;
    const PointOptions& points_;
    Gathered& out_;
    World& world_;
    TriangleMesh mesh_;  // the one at hand
};

}  // namespace

Result<Gathered> gather(const Scene& scene, const std::function<void(double)>& progress, const PointOptions& points) {
    Gathered gathered;
    Gatherer gatherer(scene, points, gathered);
    for (size_t i = 0; i < scene.shapes.size(); i++) {
        if (auto status = gatherer.add(scene.shapes[i]); !status.ok()) return status;
        progress(static_cast<double>(i + 1) / static_cast<double>(scene.shapes.size()));
    }
    gatherer.finish();
    return gathered;
}

}  // namespace raypager
