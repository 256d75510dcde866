// A coloured cloud is, to the bit, what spheres with a diffuse material of its own for each would be.
#include <gtest/gtest.h>

#include "block/point_code.hpp"
#include "reference/scenes.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"

namespace raypager {
namespace {

// Each point of the scene's clouds as a sphere shape; ids stay.
Scene with_spheres_for_points(const Scene& scene) {
    Scene result = scene;
    result.shapes.clear();
    for (const Shape& shape : scene.shapes) {
        const auto* cloud = dynamic_cast<const PointsInMemory*>(shape.points.get());
        if (cloud == nullptr) {
            result.shapes.push_back(shape);
            continue;
        }
        for (const CloudPoint& point : cloud->points()) {
            Shape sphere;
            sphere.name = "sphere";
            sphere.sphere = {point.position, point.radius};
            sphere.material = shape.material;
            if (cloud->has_color()) {
                rp_material material = scene.materials[shape.material];
                const auto reflectance = point_reflectance(point_color_code(point.color));
                std::copy(reflectance.begin(), reflectance.end(), material.color);
                sphere.material = static_cast<uint32_t>(result.materials.size());
                result.materials.push_back(material);
            }
            result.shapes.push_back(sphere);
        }
    }
    return result;
}

TEST(PointColors, are_those_of_spheres_with_materials_of_their_own) {
    const Scene scene = reference::cloud_small(600, true, 3, {40, 30});
    const support::TemporaryFolder folder;
    BakeOptions options;
    options.block_bytes = 16 << 10;
    auto points = support::bake_and_open(scene, options, folder.path(), "points");
    ASSERT_TRUE(points.ok()) << points.status().message();
    auto spheres = support::bake_and_open(with_spheres_for_points(scene), options, folder.path(), "spheres");
    ASSERT_TRUE(spheres.ok()) << spheres.status().message();
    EXPECT_GT((*spheres)->scene().ranges.size(), (*points)->scene().ranges.size() + 500);
    RenderOptions render_options;
    render_options.spp = 8;
    const auto of_points = render(**points, render_options, {});
    ASSERT_TRUE(of_points.ok()) << of_points.status().message();
    const auto of_spheres = render(**spheres, render_options, {});
    ASSERT_TRUE(of_spheres.ok()) << of_spheres.status().message();
    EXPECT_EQ(of_points->report.film_hash, of_spheres->report.film_hash);
    EXPECT_EQ(of_points->report.rays.total(), of_spheres->report.rays.total());
    // And it matters: without its colours the cloud looks different.
    Scene plain = scene;
    const auto& cloud = dynamic_cast<const PointsInMemory&>(*plain.shapes[0].points);
    plain.shapes[0].points = std::make_shared<PointsInMemory>("plain", cloud.points(), false);
    auto without = support::bake_and_open(plain, options, folder.path(), "plain");
    ASSERT_TRUE(without.ok()) << without.status().message();
    const auto of_plain = render(**without, render_options, {});
    ASSERT_TRUE(of_plain.ok()) << of_plain.status().message();
    EXPECT_NE(of_plain->report.film_hash, of_points->report.film_hash);
}

}  // namespace
}  // namespace raypager
