// Shapes of which parts are not there, in what is baked from them.
#include <gtest/gtest.h>

#include "raypager/bake.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// Whether a shape is cut out is part of its range, which a cached file keeps. What shines is not cut out at all.
TEST(BakeCutOuts, AreNotWhatTheSameShapeWasBefore) {
    Scene scene = scene_of({mesh_shape(terrain(20))});
    scene.materials.resize(2);
    const uint64_t whole = *bake_fingerprint(scene, {});
    scene.shapes[0].material = 1;
    const uint64_t other = *bake_fingerprint(scene, {});
    scene.materials[1].kind = RP_MATERIAL_MIX;
    scene.materials[1].first = RP_NONE;
    scene.materials[1].second = 0;
    scene.materials[1].amount = 0.5f;
    const uint64_t cut_out = *bake_fingerprint(scene, {});
    EXPECT_NE(whole, other);
    EXPECT_NE(other, cut_out);
    EXPECT_TRUE(bake(scene, BakeOptions{}).ok());
    scene.area_lights.push_back({{1, 1, 1}});
    scene.shapes[0].area_light = 0;
    const auto refused = bake(scene, BakeOptions{});
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.status().message().find("what shines cannot be cut out"), std::string::npos) << refused.status().message();
}

}  // namespace
}  // namespace raypager
