// Which changes of objects and instances make another scene to bake.
#include <gtest/gtest.h>

#include <set>

#include "raypager/bake.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

TEST(BakeFingerprint, FollowsObjectsAndPlacements) {
    Scene scene;
    scene.materials = {diffuse_material({0.5f, 0.5f, 0.5f}), diffuse_material({0.1f, 0.5f, 0.5f})};
    scene.shapes.resize(1);
    std::set<uint64_t> seen;
    const auto is_new = [&] { return seen.insert(*bake_fingerprint(scene, {})).second; };
    EXPECT_TRUE(is_new());
    Shape large;
    large.sphere.radius = 2;
    scene.objects = {{"o", {large, large}}, {"p", {large}}};
    EXPECT_TRUE(is_new());
    std::vector<Placement> placements(2);
    const auto place = [&] { scene.instances = {std::make_shared<InstancesInMemory>("x", placements)}; };
    place();
    EXPECT_TRUE(is_new());
    placements[1].to_world[0][3] = 1;
    place();
    EXPECT_TRUE(is_new());
    placements[1].object = 1;
    place();
    EXPECT_TRUE(is_new());
    scene.objects[1].shapes.push_back(scene.objects[0].shapes.back());
    scene.objects[0].shapes.pop_back();
    EXPECT_TRUE(is_new()) << "the same shapes, but in other objects";
    scene.objects[1].shapes[0].material = 1;
    EXPECT_TRUE(is_new());
    scene.objects[1].shapes[0].to_world = Transform::translate(0, 0, 1);
    EXPECT_TRUE(is_new());
    scene.objects[1].name = "q";
    scene.instances = {std::make_shared<InstancesInMemory>("y", placements)};
    EXPECT_FALSE(is_new()) << "names change nothing that is baked";
    scene.materials[0] = diffuse_material({0.9f, 0.5f, 0.5f});
    EXPECT_FALSE(is_new());
}

}  // namespace
}  // namespace raypager
