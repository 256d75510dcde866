// Objects and instances of scenes: what is accepted, and what tells two sets of placements apart.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "raypager/materials.hpp"
#include "raypager/scene.hpp"
#include "scene/shapes.hpp"

namespace raypager {
namespace {

Shape named_ball(const std::string& name) {
    Shape shape;
    shape.name = name;
    return shape;
}

Scene scene_with_instances() {
    Scene scene;
    scene.materials = {diffuse_material({0.5f, 0.5f, 0.5f})};
    scene.shapes = {named_ball("a")};
    scene.objects = {{"o", {named_ball("b"), named_ball("c")}}, {"p", {named_ball("d")}}};
    scene.instances = {std::make_shared<InstancesInMemory>("here", std::vector<Placement>(3))};
    return scene;
}

TEST(SceneInstances, ShapesOfObjectsComeBehindTheOthers) {
    const Scene scene = scene_with_instances();
    std::string order;
    ASSERT_TRUE(for_each_shape(scene, [&](const Shape& shape) { return order += shape.name, Status(); }).ok());
    EXPECT_EQ(order, "abcd");
    EXPECT_EQ(for_each_shape(scene, [&](const Shape& shape) { return shape.name == "c" ? Status::failed("at c") : Status(); }).message(), "at c");
}

TEST(SceneInstances, ObjectsAreCheckedAsShapesAre) {
    ASSERT_TRUE(validate(scene_with_instances()).ok());
    const auto expect_refused = [](auto change, const std::string& words) {
        Scene scene = scene_with_instances();
        scene.area_lights = {{{1, 1, 1}}};
        change(scene, scene.objects[0].shapes[1]);
        const Status status = validate(scene);
        EXPECT_NE(status.message().find(words), std::string::npos) << words << ": " << status.message();
    };
    expect_refused([](Scene&, Shape& shape) { shape.material = 1; }, "c: material 1 does not exist");
    expect_refused([](Scene&, Shape& shape) { shape.to_world.m[0][0] = NAN; }, "c: its transform is not finite");
    expect_refused([](Scene&, Shape& shape) { shape.sphere.radius = 0; }, "c: a sphere needs");
    expect_refused([](Scene&, Shape& shape) { shape.area_light = 1; }, "c: area light 1 does not exist");
    expect_refused([](Scene&, Shape& shape) { shape.backdrop = true; }, "c: a backdrop cannot be part of an object");
    expect_refused([](Scene& scene, Shape&) { scene.objects.clear(); }, "there are instances, but no objects");
    expect_refused([](Scene& scene, Shape&) { scene.instances.push_back(nullptr); }, "a source of instances is missing");
}

TEST(SceneInstances, ObjectsMayShine) {
    Scene scene = scene_with_instances();
    scene.area_lights = {{{1, 1, 1}}};
    scene.objects[0].shapes[1].area_light = 0;
    scene.objects[0].shapes[1].unseen = true;
    EXPECT_TRUE(validate(scene).ok()) << validate(scene).message();
}

TEST(SceneInstances, SourcesSayWhichMaterialsTheyHave) {
    Scene scene = scene_with_instances();
    std::vector<Placement> placements(6);
    placements[1].material = placements[3].material = 0;
    placements[4].object = 1, placements[4].material = 0;
    const auto source = std::make_shared<InstancesInMemory>("here", placements);
    EXPECT_EQ(source->materials(), (std::vector<ObjectMaterial>{{0, 0}, {1, 0}}));
    scene.instances = {source};
    EXPECT_TRUE(validate(scene).ok()) << validate(scene).message();
    placements[2].material = 1;
    scene.instances = {std::make_shared<InstancesInMemory>("here", placements)};
    EXPECT_EQ(validate(scene).message(), "here: material 1 of instances does not exist");
    placements[2] = {.object = 7, .material = 0};
    scene.instances = {std::make_shared<InstancesInMemory>("here", placements)};
    EXPECT_EQ(validate(scene).message(), "here: object 7 does not exist");
}

TEST(SceneInstances, FingerprintsTellLooksApart) {
    const auto fingerprint = [](const Placement& placement) { return InstancesInMemory("here", {placement}).fingerprint(); };
    Placement colored, other;
    colored.color.y = 0.5f;
    other.material = 0;
    EXPECT_NE(fingerprint({}), fingerprint(colored));
    EXPECT_NE(fingerprint({}), fingerprint(other));
}

TEST(SceneInstances, ObjectsMayHoldPoints) {
    Scene scene = scene_with_instances();
    scene.objects[1].shapes[0].points = std::make_shared<PointsInMemory>("points", std::vector<CloudPoint>(5), false);
    EXPECT_TRUE(validate(scene).ok()) << validate(scene).message();
}

class ManyInstances final : public InstanceSource {
public:
    explicit ManyInstances(uint64_t count) : count_(count) {}
    Status stream(const std::function<Status(std::span<const Placement>)>&) const override { return {}; }
    uint64_t count() const override { return count_; }
    std::string name() const override { return "many"; }
    uint64_t fingerprint() const override { return 0; }

private:
    uint64_t count_;
};

TEST(SceneInstances, ThereAreNoMoreThanCanBeNumbered) {
    Scene scene = scene_with_instances();
    scene.instances.push_back(std::make_shared<ManyInstances>(RP_NONE - 4));
    EXPECT_TRUE(validate(scene).ok()) << validate(scene).message();
    scene.instances.push_back(std::make_shared<ManyInstances>(1));
    EXPECT_NE(validate(scene).message().find("many: the scene has more than 4294967294 instances"), std::string::npos) << validate(scene).message();
    scene.instances.back() = std::make_shared<ManyInstances>(UINT64_MAX);
    EXPECT_FALSE(validate(scene).ok());
}

TEST(SceneInstances, FingerprintsTellPlacementsApart) {
    std::set<uint64_t> seen;
    std::vector<Placement> placements(3);
    const auto is_new = [&] { return seen.insert(InstancesInMemory("x", placements).fingerprint()).second; };
    EXPECT_TRUE(is_new());
    EXPECT_FALSE(is_new());
    EXPECT_EQ(InstancesInMemory("another name", placements).fingerprint(), InstancesInMemory("x", placements).fingerprint());
    placements[1].object = 1;
    EXPECT_TRUE(is_new());
    placements[2].to_world[2][3] = 1e-300;
    EXPECT_TRUE(is_new());
    std::swap(placements[0], placements[2]);
    EXPECT_TRUE(is_new());
    placements.pop_back();
    EXPECT_TRUE(is_new());
}

}  // namespace
}  // namespace raypager
