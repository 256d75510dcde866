// The reference's geometry: Embree against brute force in double precision, numbering, orientation, and the judge of hits.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "reference/hit_comparison.hpp"
#include "reference/mesh_shapes.hpp"
#include "reference/rays.hpp"
#include "reference/scene_builder.hpp"
#include "reference/scenes.hpp"

namespace raypager::reference {
namespace {

std::shared_ptr<const ReferenceGeometry> geometry_of(const Scene& scene) { return ReferenceGeometry::build(scene).value(); }

struct NamedScene {
    const char* name;
    Scene (*make)();
};

void PrintTo(const NamedScene& scene, std::ostream* out) { *out << scene.name; }

// Small enough for brute force.
const NamedScene hit_scenes[] = {
    {"cornell", [] { return cornell_small({.subdivisions = 2, .wall_divisions = 4}); }},
    {"cornell_spheres", [] { return cornell_small({.sphere_primitives = true, .wall_divisions = 4}); }},
    {"terrain", [] { return terrain_small(24); }},
    {"clutter", [] { return clutter_small(12, 5); }},
    {"soup", [] { return soup(1500, 2); }},
    {"shared_edges", [] { return shared_edges(4); }},
    {"overlapping_shells", [] { return overlapping_shells(6, 2); }},
};

class ReferenceHits : public testing::TestWithParam<NamedScene> {};

double sine_to_plane(const ReferenceGeometry& geometry, uint32_t triangle, const Ray& ray) {
    const Corners p = geometry.corners(triangle);
    return std::abs(dot(normalized(cross(p[1] - p[0], p[2] - p[0])), normalized(Vec3(ray.direction))));
}

// What the float edge test of Embree 3's robust mode is known to get wrong, and the brute force does not:
//  - A ray through a vertex may slip between the triangles around it: each edge is tested alike from both its sides, but the edges
//    that meet in a vertex are rounded one by one. A triangle that the ray sees edge-on is like a vertex to its neighbours.
//  - In the plane of a triangle all its edge functions vanish, so that a ray may "hit" coplanar triangles that it does not come near.
bool is_known_fault(const ReferenceGeometry& geometry, const Ray& ray, const Hit& exact, const Hit& claimed) {
    constexpr double flat = 1e-6;
    if (claimed.found() && !geometry.is_sphere(claimed.primitive) && sine_to_plane(geometry, claimed.primitive, ray) < flat) return true;
    if (!exact.found() || exact.t >= claimed.t || geometry.is_sphere(exact.primitive)) return false;
    const Vec3 point = geometry.position(exact);
    double scale = max_magnitude(Vec3(ray.origin)), to_vertex = infinity;
    for (const Vec3& corner : geometry.corners(exact.primitive)) {
        scale = std::max(scale, max_magnitude(corner));
        to_vertex = std::min(to_vertex, length(cross(corner - point, normalized(Vec3(ray.direction)))));
    }
    const double close = 0x1p-23 * scale;
    if (to_vertex <= close) return true;
    for (uint32_t id = 0; id < geometry.primitive_count(); id++) {
        if (geometry.is_sphere(id) || geometry.is_degenerate(id)) continue;
        if (sine_to_plane(geometry, id, ray) < flat && distance_to_primitive(geometry, id, ray) <= close) return true;
    }
    return false;
}

// 100 000 rays in all over the scenes and kinds, closest hits and occlusion. Differences that rounding does not explain must be known
// faults, of at most one ray in a hundred.
TEST_P(ReferenceHits, EmbreeEqualsBruteForce) {
    const Scene scene = GetParam().make();
    const auto geometry = geometry_of(scene);
    for (const RayKind kind : all_ray_kinds) {
        constexpr size_t count = 2500;
        constexpr uint64_t seed = 11;
        HitAudit hits(*geometry), shadows(*geometry);
        size_t found = 0, known = 0, unknown = 0;
        for (const Ray& ray : make_rays(*geometry, kind, count, seed)) {
            const Hit exact = geometry->closest_brute_force(ray), claimed = geometry->closest(ray);
            found += exact.found();
            const Agreement closest = hits.closest(ray, exact, claimed);
            const Agreement occluded = shadows.occluded(ray, exact.found(), geometry->occluded(ray));
            if (closest != Agreement::wrong && occluded != Agreement::wrong) continue;
            (is_known_fault(*geometry, ray, exact, claimed) ? known : unknown)++;
        }
        const std::string place = fmt::format("{}, {} rays, seed {}", GetParam().name, name(kind), seed);
        EXPECT_EQ(unknown, 0u) << place << "\nclosest: " << hits.report() << "\noccluded: " << shadows.report();
        EXPECT_LE(known, count / 100) << place << "\nclosest: " << hits.report() << "\noccluded: " << shadows.report();
        EXPECT_GT(found, count / 20) << place << ": too few hits to say anything";
        const std::string counts = hits.report();
        std::cout << fmt::format("{:<18} {:<13} {} hit, {} known faults of Embree; {}\n", GetParam().name, name(kind), found, known,
                                 counts.substr(0, counts.find('\n')));
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, ReferenceHits, testing::ValuesIn(hit_scenes),
                         [](const testing::TestParamInfo<NamedScene>& parameter) { return std::string(parameter.param.name); });

// No ray from inside may leave a closed surface, least of all through its edges and vertices.
TEST(ReferenceGeometry, ClosedSurfacesLeakNoRay) {
    SceneBuilder builder({8, 8});
    const uint32_t material = builder.material(diffuse(Vec3(0.5)));
    builder.camera({0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 45);
    builder.add("ball", icosphere(1, 2), material, Transform::rotate(20, 1, 2, 3));
    const Scene scene = builder.finish();
    const auto geometry = geometry_of(scene);
    std::mt19937_64 engine(5);
    std::uniform_real_distribution<float> coordinate(-0.5f, 0.5f);
    for (uint32_t id = 0; id < geometry->primitive_count(); id++) {
        const Corners corners = geometry->corners(id);
        for (int i = 0; i < 60; i++) {
            const Float3 origin{coordinate(engine), coordinate(engine), coordinate(engine)};
            const Vec3 target = i % 3 == 0 ? corners[0] : corners[0] + (0.1 * (i % 10)) * (corners[1] - corners[0]);
            const Ray ray{origin, (target - Vec3(origin)).to_float()};
            ASSERT_TRUE(geometry->closest_brute_force(ray).found()) << "brute force, triangle " << id << " ray " << i;
            ASSERT_TRUE(geometry->closest(ray).found()) << "Embree, triangle " << id << " ray " << i;
        }
    }
}

TEST(ReferenceGeometry, NumbersThroughAllShapes) {
    SceneBuilder builder({8, 8});
    const uint32_t material = builder.material(diffuse(Vec3(0.5)));
    builder.camera({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 45);
    // In the world, the first quad's triangles are so far out that float sees no area; they are numbered all the same.
    builder.add("flat", quad({0, 0, 0}, {1e-4, 0, 0}, {0, 1e-4, 0}), material, Transform::translate(1e5, 1e5, 0));
    builder.add_sphere("ball", {0, 0, -3}, 1, material);
    builder.add("quad", quad({-1, -1, 1}, {2, 0, 0}, {0, 2, 0}), material);
    builder.add_sphere("second ball", {0, 0, -6}, 1, material);
    const Scene scene = builder.finish();
    const auto geometry = geometry_of(scene);
    ASSERT_EQ(geometry->primitive_count(), 6u);
    const uint32_t shapes[] = {0, 0, 1, 2, 2, 3};
    for (uint32_t id = 0; id < 6; id++) EXPECT_EQ(geometry->shape_of(id), shapes[id]) << id;
    EXPECT_TRUE(geometry->is_degenerate(0));
    EXPECT_TRUE(geometry->is_degenerate(1));
    const struct {
        Ray ray;
        uint32_t primitive;
        double t;
    } cases[] = {{{{0.5f, -0.5f, 9}, {0, 0, -2}}, 3, 4}, {{{-0.5f, 0.5f, 9}, {0, 0, -2}}, 4, 4},
                 {{{0, 0, 0}, {0, 0, -1}}, 2, 2},        {{{0, 0, -3}, {0, 0, -1}}, 2, 1},  // from inside
                 {{{0, 0, -4.5f}, {0, 0, -1}}, 5, 0.5},  {{{0, 0, -4.5f}, {0, 0, -1}, 0.25f}, RP_NONE, infinity}};
    for (const auto& c : cases) {
        const Hit hit = geometry->closest(c.ray), checked = geometry->closest_brute_force(c.ray);
        EXPECT_EQ(hit.primitive, c.primitive);
        EXPECT_EQ(checked.primitive, c.primitive);
        // Embree, which finds triangles, divides by a reciprocal whose last bits depend on the processor.
        EXPECT_FLOAT_EQ(static_cast<float>(hit.t), static_cast<float>(c.t));
        EXPECT_DOUBLE_EQ(checked.t, c.t);
    }
}

TEST(ReferenceGeometry, NormalsFollowTheOrientation) {
    for (const bool mirrored : {false, true}) {
        for (const bool reversed : {false, true}) {
            SceneBuilder builder({8, 8});
            const uint32_t material = builder.material(diffuse(Vec3(0.5)));
            builder.camera({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 45);
            const Transform to_world = Transform::scale(1, 1, mirrored ? -1 : 1);
            builder.add("mesh", icosphere(1, 1), material, to_world).reverse_orientation = reversed;
            Shape& sphere = builder.add_sphere("sphere", {0, 0, mirrored ? -5.0 : 5.0}, 1, material);
            sphere.to_world = to_world;
            sphere.reverse_orientation = reversed;
            const Scene scene = builder.finish();
            const auto geometry = geometry_of(scene);
            for (const float z : {9.0f, 3.0f}) {
                const Hit hit = geometry->closest({{0.1f, 0.2f, z}, {0, 0, -1}});
                ASSERT_TRUE(hit.found());
                EXPECT_EQ(hit.normal.z > 0, !reversed) << "mirrored " << mirrored << " z " << z;
                EXPECT_NEAR(length(hit.normal), 1, 1e-12);
                EXPECT_NEAR(length(geometry->position(hit) - Vec3(0.1, 0.2, z - hit.t)), 0, 1e-5);  // t of Embree is a float
            }
        }
    }
}

// A ball with normals, stretched to an ellipsoid x^2 + y^2 + (z / 2)^2 = 1, whose normals are (x, y, z / 4).
TEST(ReferenceGeometry, ShadingNormalsGoWithTheInverseTranspose) {
    SceneBuilder builder({8, 8});
    const uint32_t material = builder.material(diffuse(Vec3(0.5)));
    builder.camera({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 45);
    builder.add("egg", icosphere(1, 4, true), material, Transform::scale(1, 1, 2));
    const Scene scene = builder.finish();
    const auto geometry = geometry_of(scene);
    for (const Ray& ray : make_rays(*geometry, RayKind::random, 500, 3)) {
        const Hit hit = geometry->closest(ray);
        if (!hit.found()) continue;
        const Vec3 p = geometry->position(hit), shading = geometry->shading_normal(hit);
        // 2562 vertices: interpolation is off by about the square of half their distance (0.03), flat normals by that distance.
        EXPECT_NEAR(dot(shading, normalized(Vec3(p.x, p.y, p.z / 4))), 1, 1e-4);
        EXPECT_NEAR(length(shading), 1, 1e-12);
    }
}

TEST(ReferenceGeometry, RefusesStretchedSpheres) {
    SceneBuilder builder({8, 8});
    const uint32_t material = builder.material(diffuse(Vec3(0.5)));
    builder.camera({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 45);
    builder.add_sphere("egg", {0, 0, 0}, 1, material).to_world = Transform::scale(1, 1, 2);
    const auto built = ReferenceGeometry::build(builder.finish());
    ASSERT_FALSE(built.ok());
    EXPECT_NE(built.status().message().find("egg"), std::string::npos) << built.status().message();
}

// The judge of hits must not excuse what is wrong.
TEST(ReferenceHitAudit, FindsFaults) {
    const Scene scene = shared_edges(4);
    const auto geometry = geometry_of(scene);
    HitAudit audit(*geometry);
    const Ray ray{{-3.3f, -0.7f, 5}, {0, 0, -1}};  // onto the grid, inside a triangle
    const Hit hit = geometry->closest_brute_force(ray);
    ASSERT_NEAR(hit.t, 5, 1e-9);
    EXPECT_EQ(audit.closest(ray, hit, hit), Agreement::same);
    EXPECT_EQ(audit.closest(ray, hit, Hit{}), Agreement::wrong) << "a hole";
    Hit claimed = hit;
    claimed.t *= 1 + 1e-4;
    EXPECT_EQ(audit.closest(ray, hit, claimed), Agreement::wrong) << "the wrong distance";
    claimed = hit;
    claimed.primitive++;
    EXPECT_EQ(audit.closest(ray, hit, claimed), Agreement::wrong) << "the other triangle of the quad";
    claimed = {.t = 2, .primitive = hit.primitive};
    EXPECT_EQ(audit.closest(ray, hit, claimed), Agreement::wrong) << "nothing is there";
    EXPECT_EQ(audit.occluded(ray, true, false), Agreement::wrong);
    const Ray upwards{{-3.3f, -0.7f, 5}, {0, 0, 1}};
    EXPECT_EQ(audit.closest(upwards, Hit{}, hit), Agreement::wrong);
    EXPECT_EQ(audit.occluded(upwards, false, true), Agreement::wrong);
    EXPECT_EQ(audit.count(Agreement::wrong), 7u);
}

// Exactly through an edge that two triangles share: either may be reported, but not neither. At the outline of the grid, both may.
TEST(ReferenceHitAudit, ExcusesOutlinesButNoLeaks) {
    const Scene scene = shared_edges(4);
    const auto geometry = geometry_of(scene);
    HitAudit audit(*geometry);
    const Ray through_edge{{-3, -0.75f, 5}, {0, 0, -1}};
    const Hit hit = geometry->closest_brute_force(through_edge);
    ASSERT_TRUE(hit.found());
    uint32_t sharing = 0;
    for (uint32_t id = 0; id < geometry->primitive_count(); id++) {
        const Hit other = geometry->intersect(id, through_edge);
        if (!other.found() || other.t != hit.t) continue;
        sharing++;
        EXPECT_EQ(audit.closest(through_edge, hit, other), id == hit.primitive ? Agreement::same : Agreement::tie);
    }
    EXPECT_EQ(sharing, 2u);
    EXPECT_EQ(audit.closest(through_edge, hit, Hit{}), Agreement::wrong) << "a leak";
    EXPECT_EQ(audit.occluded(through_edge, true, false), Agreement::wrong) << "a leak";

    const Ray at_outline{{-4, -0.75f, 5}, {0, 0, -1}};
    const Hit outline = geometry->closest_brute_force(at_outline);
    ASSERT_TRUE(outline.found());
    EXPECT_EQ(audit.closest(at_outline, outline, Hit{}), Agreement::rounding);
    EXPECT_EQ(audit.occluded(at_outline, true, false), Agreement::rounding);
    const Ray beside{{std::nextafter(-4.0f, -5.0f), -0.75f, 5}, {0, 0, -1}};
    EXPECT_FALSE(geometry->occluded_brute_force(beside));
    EXPECT_EQ(audit.closest(beside, Hit{}, outline), Agreement::rounding);
    EXPECT_EQ(audit.occluded(beside, false, true), Agreement::rounding);
}

}  // namespace
}  // namespace raypager::reference
