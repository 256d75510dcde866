// Coordinates of textures at hits: what kernels make of those of a triangle's corners, against plain arithmetic in double precision, in both ways of
// tracing.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "gather/gather.hpp"
#include "reference/geometry.hpp"
#include "reference/rays.hpp"
#include "reference/scenes.hpp"
#include "render/render.hpp"
#include "scene/octahedral.hpp"
#include "support/device_scene.hpp"
#include "support/textured_scene.hpp"

namespace raypager {
namespace {

using reference::Vec3;

// painted_small with coordinates at its vertices and a texture program, which says no more than the material itself, in every other material.
Scene textured_small(bool with_uvs = true) {
    Scene scene = reference::painted_small(24, {16, 16});
    support::set_grey_program(scene);
    for (Shape& shape : scene.shapes) {
        const auto* source = dynamic_cast<const MeshInMemory*>(shape.mesh.get());
        if (!source) continue;
        TriangleMesh mesh = source->mesh();
        for (size_t i = 0; i < mesh.positions.size() && with_uvs; i++) {
            const Float3& p = mesh.positions[i];
            mesh.uvs.push_back({0.7f * p.x + 0.3f * std::sin(3 * p.y), 2 * p.y - p.z});
        }
        // Some of its triangles have no area in textures, and some vertices no coordinates.
        for (size_t i = 0; i < mesh.uvs.size(); i += 11) mesh.uvs[i] = {};
        shape.mesh = std::make_shared<MeshInMemory>(source->name(), std::move(mesh));
    }
    for (rp_material& material : scene.materials)
        if (material.kind == RP_MATERIAL_DIFFUSE) material.flags |= 1u << RP_MATERIAL_PROGRAM_SHIFT;
    return scene;
}

// What is expected of a hit.
struct Place {
    double u = 0, v = 0, density = 0;
    Vec3 tangent{0.0};
};

Place expected_place(const World& world, uint32_t primitive, const Vec3& hit) {
    Place place;
    if (world.is_sphere(primitive)) return place;
    Vec3 p[3];
    double u[3], v[3];
    for (size_t k = 0; k < 3; k++) {
        const uint32_t vertex = world.primitives[primitive][k];
        p[k] = Vec3(world.positions[vertex]);
        u[k] = world.uv(vertex).x;
        v[k] = world.uv(vertex).y;
    }
    const Vec3 e1 = p[1] - p[0], e2 = p[2] - p[0], normal = cross(e1, e2);
    const double size = dot(normal, normal), b = dot(cross(hit - p[0], e2), normal) / size, c = dot(cross(e1, hit - p[0]), normal) / size;
    place.u = u[0] + b * (u[1] - u[0]) + c * (u[2] - u[0]);
    place.v = v[0] + b * (v[1] - v[0]) + c * (v[2] - v[0]);
    const double area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
    place.density = std::sqrt(std::abs(area) / std::sqrt(size));
    place.tangent = (area < 0 ? -1.0 : 1.0) * ((v[2] - v[0]) * e1 - (v[1] - v[0]) * e2);
    return place;
}

class TextureCoordinates : public testing::Test {
protected:
    std::vector<support::ProbeHit> trace(const std::shared_ptr<const BlockFile>& file, const std::vector<support::ProbeRay>& rays,
                                         Traversal traversal, const std::string& definitions) const {
        auto device = support::DeviceScene::create(file, 0, traversal);
        if (!device.ok()) throw std::runtime_error(device.status().message());
        auto hits = (*device)->trace(rays, definitions);
        if (!hits.ok()) throw std::runtime_error(hits.status().message());
        return std::move(*hits);
    }
    support::TemporaryFolder folder_;
};

TEST_F(TextureCoordinates, are_interpolated_alike_in_both_ways_of_tracing) {
    const Scene scene = textured_small();
    BakeOptions options;
    options.block_bytes = 16 << 10;
    const auto file = support::bake_and_open(scene, options, folder_.path(), "scene");
    ASSERT_TRUE(file.ok()) << file.status().message();
    ASSERT_TRUE((*file)->scene().has_uvs());
    const auto gathered = gather(scene, [](double) {});
    ASSERT_TRUE(gathered.ok());
    const auto geometry = reference::ReferenceGeometry::build(scene);
    ASSERT_TRUE(geometry.ok());
    std::vector<support::ProbeRay> rays;
    for (const reference::RayKind kind : {reference::RayKind::random, reference::RayKind::edges})
        for (const reference::Ray& ray : reference::make_rays(**geometry, kind, 20000, 7)) rays.push_back({ray.origin, INFINITY, ray.direction});
    std::map<Traversal, std::vector<support::ProbeHit>> places;
    for (const Traversal traversal : support::traversals()) {
        const auto hits = trace(*file, rays, traversal, "");
        places[traversal] = trace(*file, rays, traversal, " -DRP_TANGENTS -DRP_PROBE_UVS");
        size_t with_uvs = 0, with_tangents = 0;
        for (size_t i = 0; i < rays.size(); i++) {
            const support::ProbeHit& found = places[traversal][i];
            ASSERT_EQ(found.primitive, hits[i].primitive);
            if (found.primitive == RP_NONE) continue;
            const Place expected = expected_place(gathered->world, found.primitive, Vec3(hits[i].position));
            // The hit lies on the triangle but for roundings of its coordinates.
            const double near = 1e-5 * (1 + expected.density);
            ASSERT_NEAR(found.position.x, expected.u, near) << "primitive " << found.primitive;
            ASSERT_NEAR(found.position.y, expected.v, near);
            ASSERT_NEAR(found.position.z, expected.density, 1e-3 * expected.density + 1e-5);
            with_uvs += expected.u != 0;
            if (found.normal == RP_NONE) {
                ASSERT_LE(expected.density, 1e-2);
                continue;
            }
            with_tangents++;
            const Vec3 tangent(decode_octahedral(found.normal));
            ASSERT_GT(dot(tangent, expected.tangent), 0.999 * length(expected.tangent));
        }
        EXPECT_GT(with_uvs, 10000u);
        EXPECT_GT(with_tangents, 10000u);
    }
    for (size_t i = 0; i < rays.size() && places.size() == 2; i++) {
        const auto &one = places[Traversal::ray][i], &other = places[Traversal::stream][i];
        ASSERT_EQ(one.position, other.position) << "ray " << i;
        ASSERT_EQ(one.normal, other.normal) << "ray " << i;
    }
}

// A program that says no more than the material does changes nothing, and neither do coordinates that nobody looks at.
TEST_F(TextureCoordinates, leave_pictures_as_they_are) {
    const auto film = [&](const Scene& scene, Traversal traversal, const char* name) {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        const auto file = support::bake_and_open(scene, options, folder_.path(), name);
        if (!file.ok()) throw std::runtime_error(file.status().message());
        RenderOptions render_options;
        render_options.spp = 4;
        render_options.tuning.traversal = traversal;
        render_options.geometry_limit_percent = 50;
        const auto result = render(**file, render_options, {});
        if (!result.ok()) throw std::runtime_error(result.status().message());
        return result->report.film_hash;
    };
    for (const Traversal traversal : support::traversals())
        EXPECT_EQ(film(textured_small(), traversal, "with"), film(textured_small(false), traversal, "without"));
}

// Where no material has a program they take no room.
TEST_F(TextureCoordinates, are_left_out_where_nothing_reads_them) {
    Scene scene = textured_small();
    for (rp_material& material : scene.materials) material.flags &= RP_MATERIAL_FLAGS;
    const auto file = support::bake_and_open(scene, {}, folder_.path(), "unread"),
               other = support::bake_and_open(reference::painted_small(24, {16, 16}), {}, folder_.path(), "none");
    ASSERT_TRUE(file.ok() && other.ok());
    EXPECT_FALSE((*file)->scene().has_uvs());
    EXPECT_EQ((*file)->scene().stored_bytes(), (*other)->scene().stored_bytes());
    EXPECT_EQ((*file)->scene().geometry_bytes(BlockForm::wide), (*other)->scene().geometry_bytes(BlockForm::wide));
}

}  // namespace
}  // namespace raypager
