// Materials with images, and lights, for scenes that are built in memory.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "raypager/image_source.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

std::shared_ptr<const ImageSource> small_image(TexelKind kind, uint32_t channels) {
    const ImageShape shape{2, 2, channels, kind};
    return memory_image("image", shape, std::vector<std::byte>(4 * channels * bytes_of_channel(kind)));
}

Scene lit_scene() {
    Scene scene;
    scene.camera = *make_camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 45, scene.width, scene.height);
    scene.shapes.emplace_back();  // a sphere
    return scene;
}

TEST(ImportImageParameters, AreReadByTheProgramOfTheMaterial) {
    Scene scene = lit_scene();
    const std::vector<ImageParameter> images = {{RP_PARAMETER_COLOR, small_image(TexelKind::unsigned_8, 4), {0.5f, 1, 1}, {2, 3}},
                                                {RP_PARAMETER_ALPHA, small_image(TexelKind::unsigned_8, 1)}};
    const auto number = add_material(scene, coated_diffuse_material({1, 1, 1}, 1.5f, 0.5f), images);
    ASSERT_TRUE(number) << number.status().message();
    EXPECT_EQ(*number, 0u);
    EXPECT_EQ(scene.images.size(), 2u);
    ASSERT_EQ(scene.texture_ops.size(), 4u);
    EXPECT_EQ(scene.materials[0].flags >> RP_MATERIAL_PROGRAM_SHIFT, 1u);
    const rp_texture_map& map = scene.texture_maps[scene.texture_ops[0].map];
    EXPECT_EQ(map.m[0], 2);
    EXPECT_EQ(map.m[5], -3);  // v goes upwards
    EXPECT_EQ(map.m[6], 1);
    prepare_spheres(scene);
    const Status status = validate(scene);
    EXPECT_TRUE(status) << status.message();
}

TEST(ImportImageParameters, MoreThanAPathKeepsAreRefusedAndLeaveNothingBehind) {
    Scene scene = lit_scene();
    ASSERT_TRUE(add_material(scene, clay_material(), {}));
    std::vector<ImageParameter> images;
    for (int i = 0; i < 17; i++) images.push_back({RP_PARAMETER_COLOR, small_image(TexelKind::half, 4)});  // two words each
    const auto number = add_material(scene, clay_material(), images);
    ASSERT_FALSE(number);
    EXPECT_EQ(number.status().kind(), ErrorKind::usage);
    EXPECT_EQ(scene.materials.size(), 1u);
    EXPECT_TRUE(scene.images.empty() && scene.texture_ops.empty() && scene.texture_maps.empty());
}

TEST(ImportLights, OfScenesInMemoryAreValid) {
    Scene scene = lit_scene();
    scene.materials = {clay_material()};
    scene.lights = {point_light({0, 1, 0}, {1, 2, 3}), spot_light({0, 1, 0}, {0, -3, 0}, {1, 1, 1}, 60, 30), distant_light({0, 0, 2}, {1, 1, 1})};
    EXPECT_EQ(scene.lights[1].e1[1], -1);
    EXPECT_NEAR(scene.lights[1].e2[0], 0.5, 1e-6);
    EXPECT_NEAR(scene.lights[1].e2[1], std::sqrt(0.75), 1e-6);
    EXPECT_EQ(scene.lights[2].p[2], 1);
    const Status status = validate(scene);
    EXPECT_TRUE(status) << status.message();
}

}  // namespace
}  // namespace raypager
