// What a ray hits, found in two ways that share nothing with the renderer: by Embree, and by a test of every primitive in double
// precision. Both see the same world-space primitives: positions transformed in double and rounded once to float.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "raypager/abi/types.h"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "reference/vector.hpp"

namespace raypager::reference {

// Points origin + t direction with 0 < t <= tmax; direction is not normalised.
struct Ray {
    Float3 origin, direction;
    float tmax = std::numeric_limits<float>::infinity();
};

struct Hit {
    double t = infinity;
    uint32_t primitive = RP_NONE;
    double u = 0, v = 0;  // barycentric weights of vertices 1 and 2; 0 for spheres
    Vec3 normal{};        // geometric, unit, pointing outside: cross(v1 - v0, v2 - v0) after the flip of orientation
    bool found() const { return primitive != RP_NONE; }
};

// A triangle's world-space corners, in the order that gives the normal.
using Corners = std::array<Vec3, 3>;

struct WorldSphere {
    Float3 center;
    float radius = 0;
    bool normal_inwards = false;
};

class ReferenceGeometry {
public:
    // Loads all meshes. Fails if a mesh does, or if a sphere's transform would make it an ellipsoid.
    static Result<std::shared_ptr<const ReferenceGeometry>> build(const Scene& scene);
    ~ReferenceGeometry();
    ReferenceGeometry(const ReferenceGeometry&) = delete;
    ReferenceGeometry& operator=(const ReferenceGeometry&) = delete;

    // By Embree, robust mode, float precision for triangles. Of hits at the same distance any may be returned.
    Hit closest(const Ray& ray) const;
    bool occluded(const Ray& ray) const;
    // By testing all primitives in double precision. Of hits at the same distance the lowest primitive is returned.
    Hit closest_brute_force(const Ray& ray) const;
    bool occluded_brute_force(const Ray& ray) const;
    // One primitive, in double precision; watertight between triangles that share an edge, edges belong to the triangle.
    // Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, JCGT 2(1), 2013.
    Hit intersect(uint32_t primitive, const Ray& ray) const;

    // Primitives are numbered through all shapes in the scene's order; a sphere counts as one. Degenerate ones are numbered, too.
    uint32_t primitive_count() const { return ranges_.back().first_primitive; }
    uint32_t shape_of(uint32_t primitive) const;  // index into Scene::shapes
    bool is_sphere(uint32_t primitive) const { return range_of(primitive).sphere; }
    Corners corners(uint32_t primitive) const;            // REQUIRES: not a sphere
    const WorldSphere& sphere(uint32_t primitive) const;  // REQUIRES: a sphere
    double area(uint32_t primitive) const;
    bool is_degenerate(uint32_t primitive) const { return !(area(primitive) > 0); }  // never hit

    Vec3 position(const Hit& hit) const;        // on the primitive, whatever the precision of hit.t
    Vec3 shading_normal(const Hit& hit) const;  // unit; hit.normal where the mesh has none; on either side
    Float2 uv(const Hit& hit) const;            // (0, 0) where the mesh has none, and on spheres
    Vec3 tangent(const Hit& hit) const;         // of a triangle: where u grows while v stays, as pbrt has it; of any length
    Vec3 lower() const { return lower_; }       // bounds of all that can be hit
    Vec3 upper() const { return upper_; }

private:
    struct Range {  // of one shape; the last one, without shape, marks the end
        uint32_t first_primitive = 0;
        uint32_t first = 0;  // index into triangles_ or spheres_
        bool sphere = false;
    };
    struct EmbreeScene;
    struct ShearedRay;

    ReferenceGeometry();
    Status add_shape(const Shape& shape);
    Status add_mesh(const Shape& shape);
    Status add_sphere(const Shape& shape);
    Status add_points(const Shape& shape);
    void find_bounds();
    const Range& range_of(uint32_t primitive) const;
    const Triangle& triangle(uint32_t primitive) const;
    Hit intersect(uint32_t primitive, const ShearedRay& ray) const;
    Hit intersect_triangle(uint32_t primitive, const ShearedRay& ray) const;

    std::vector<Range> ranges_;
    std::vector<Float3> positions_;
    std::vector<Float3> normals_;  // beside positions_; zero: none
    std::vector<Float2> uvs_;      // likewise
    std::vector<Triangle> triangles_;
    std::vector<WorldSphere> spheres_;
    Vec3 lower_{infinity}, upper_{-infinity};
    std::unique_ptr<EmbreeScene> embree_;
};

}  // namespace raypager::reference
