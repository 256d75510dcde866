// What instances have of their own, as it is baked: lights in each place, materials and colours.
#include <gtest/gtest.h>

#include <cmath>

#include "bake/instance_traits.hpp"
#include "bake/restyle.hpp"
#include "raypager/materials.hpp"
#include "scene/check_material.hpp"
#include "scene/emitters.hpp"
#include "store/check_scene.hpp"
#include "unit/bake_instanced_scene.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// Two objects that shine, the second by spheres, too, and unseen, and one that does not; with lamps of the scene's own.
Scene shining_scene() {
    Scene scene = instanced_scene(0);
    scene.materials = {diffuse_material({0.5f, 0.5f, 0.5f}), diffuse_material({0.2f, 0.4f, 0.6f}), conductor_of_reflectance({1, 1, 1}, 0.1f)};
    scene.area_lights = {{{1, 2, 3}}, {{4, 5, 6}, true}, {{7, 8, 9}, false, 2.5f}, {{3, 2, 1}}};
    scene.shapes[1].area_light = 0;
    scene.objects.resize(3);
    scene.objects[0] = {"mesh", {mesh_shape(terrain(9)), mesh_shape(icosphere(1))}};
    scene.objects[0].shapes[1].area_light = 2;
    scene.objects[0].shapes[1].to_world = Transform::translate(1, 2, 3) * Transform::scale(-1, 1, 2);
    scene.objects[1] = {"spheres", {sphere_shape({1, 1, 0}, 0.25f), mesh_shape(terrain(3)), mesh_shape(terrain(2)), sphere_shape({0, 4, 0}, 0.5f)}};
    scene.objects[1].shapes[0].area_light = 3;
    scene.objects[1].shapes[1].area_light = 1;
    scene.objects[1].shapes[2].area_light = 0;
    scene.objects[1].shapes[2].unseen = true;
    scene.objects[2] = {"dark", {mesh_shape(terrain(9))}};
    scene.lights.push_back(infinite_light({1, 1, 1}));
    std::vector<Placement> placements = random_placements(12, 3, 4);
    for (Placement& p : placements) {
        if (p.object != 1) continue;
        // Even, some mirrored.
        p = placement(
            1, Transform::translate(p.to_world[0][3], 2, 1) * Transform::rotate(77, 1, 2, 3) * Transform::scale(p.to_world[0][3] < 0 ? -2 : 2, 2, 2));
    }
    scene.instances = {std::make_shared<InstancesInMemory>("here", std::move(placements))};
    return scene;
}

std::vector<Placement> placements_in(const Scene& scene) {
    std::vector<Placement> all;
    for (const auto& source : scene.instances)
        EXPECT_TRUE(source->stream([&](std::span<const Placement> some) { return all.insert(all.end(), some.begin(), some.end()), Status(); }).ok());
    return all;
}

void place(Scene& scene, std::vector<Placement> placements) {
    scene.instances = {std::make_shared<InstancesInMemory>("here", std::move(placements))};
}

// The scene with what shines of the instances as shapes of their own: its lights are what those of instances have to be.
Scene with_copies_of_lamps(const Scene& scene) {
    Scene copies = scene;
    copies.objects.clear();
    copies.instances.clear();
    for (const bool are_unseen : {false, true})
        for (const Placement& placed : placements_in(scene))
            for (Shape shape : scene.objects[placed.object].shapes) {
                if (!shape.area_light || shape.unseen != are_unseen) continue;
                shape.to_world = transform_of(placed) * shape.to_world;
                copies.shapes.push_back(shape);
            }
    return copies;
}

double dot(const float (&a)[3], const std::array<double, 3>& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
std::array<double, 3> normal_of_light(const rp_light& l) {
    return {double{l.e1[1]} * l.e2[2] - double{l.e1[2]} * l.e2[1], double{l.e1[2]} * l.e2[0] - double{l.e1[0]} * l.e2[2],
            double{l.e1[0]} * l.e2[1] - double{l.e1[1]} * l.e2[0]};
}

void expect_same_light(const rp_light& light, const rp_light& expected) {
    ASSERT_EQ(light.kind, expected.kind);
    EXPECT_EQ(light.flags, expected.flags);
    // A record holds its numbers as floats; coordinates are some 50 at most.
    const auto near = [](float a, float b) { return std::abs(a - b) <= 1e-4f * (1 + std::abs(b)); };
    EXPECT_NEAR(light.area, expected.area, 1e-4 * expected.area);
    for (int a = 0; a < 3; a++) {
        EXPECT_TRUE(near(light.p[a], expected.p[a])) << light.p[a] << " " << expected.p[a];
        EXPECT_TRUE(near(light.e1[a], expected.e1[a])) << light.e1[a] << " " << expected.e1[a];
        EXPECT_TRUE(near(light.e2[a], expected.e2[a])) << light.e2[a] << " " << expected.e2[a];
        EXPECT_NEAR(light.radiance[a], expected.radiance[a], 2e-4 * expected.radiance[a]);
    }
    if (light.kind == RP_LIGHT_TRIANGLE) {
        const auto n = normal_of_light(expected), m = normal_of_light(light);
        EXPECT_GT(n[0] * m[0] + n[1] * m[1] + n[2] * m[2], 0);
    }
}

TEST(BakeInstanceTraits, LightsOfInstancesAreThoseOfCopies) {
    TemporaryFolder folder;
    const Scene scene = shining_scene();
    const auto file = bake_and_open(scene, folder / "a.rpb", 16 << 10);
    const auto copies = bake_and_open(with_copies_of_lamps(scene), folder / "b.rpb", 16 << 10);
    const BakedScene& baked = file->scene();
    const std::vector<rp_light>& expected = copies->scene().lights;
    ASSERT_EQ(baked.lights.size(), expected.size());
    ASSERT_EQ(baked.instance_traits.size(), 8u);
    EXPECT_EQ(baked.lights[0].kind, RP_LIGHT_SPHERE);
    EXPECT_EQ(baked.lights[1].kind, RP_LIGHT_INFINITE) << "those of instances come last";
    // Those of copies: first all that are seen, then all that are not, then the sky.
    size_t seen = 1, not_seen = expected.size() - 1;
    for (const rp_instance_traits& t : baked.instance_traits) not_seen -= t.light_count - baked.lights_of_object(t.object);
    size_t next = 2;
    for (const rp_instance_traits& t : baked.instance_traits) {
        ASSERT_EQ(t.first_light, next);
        ASSERT_EQ(t.light_count, t.object == 0 ? 80u : 1 + 18 + 8u);
        next += t.light_count;
        for (uint32_t i = 0; i < t.light_count; i++) {
            SCOPED_TRACE(testing::Message() << "light " << i << " of an instance of object " << t.object);
            expect_same_light(baked.lights[t.first_light + i], expected[i < baked.lights_of_object(t.object) ? seen++ : not_seen++]);
        }
    }
    EXPECT_EQ(next, baked.lights.size());
    EXPECT_EQ(not_seen, expected.size() - 1);
    double sum = 0;
    for (const rp_light& light : baked.lights) sum += light.probability;
    EXPECT_NEAR(sum, 1, 1e-4);
}

// They shine outwards, whatever mirrors them.
TEST(BakeInstanceTraits, ClosedShapesShineOutwards) {
    TemporaryFolder folder;
    Scene scene = shining_scene();
    scene.objects[0].shapes[1].to_world = Transform::scale(-1, 1, 2);
    std::vector<Placement> placements;
    for (const double sign : {1.0, -1.0}) placements.push_back(placement(0, Transform::translate(30 * sign, 0, 0) * Transform::scale(sign, 1, 3)));
    place(scene, placements);
    const auto file = bake_and_open(scene, folder / "a.rpb", 16 << 10);
    ASSERT_EQ(file->scene().instance_traits.size(), 2u);
    for (size_t i = 0; i < 2; i++) {
        const rp_instance_traits& t = file->scene().instance_traits[i];
        for (uint32_t k = 0; k < t.light_count; k++) {
            const rp_light& light = file->scene().lights[t.first_light + k];
            const float from_middle[3] = {light.p[0] - (i == 0 ? 30.0f : -30.0f), light.p[1], light.p[2]};
            ASSERT_GT(dot(from_middle, normal_of_light(light)), 0);
        }
    }
}

TEST(BakeInstanceTraits, AreSharedByThoseThatLookAlike) {
    TemporaryFolder folder;
    Scene scene = shining_scene();
    std::vector<Placement> placements = random_placements(400, 1, 8);
    std::mt19937 random(1);
    for (Placement& p : placements) {
        p.object = 2;
        p.material = random() % 2 ? RP_NONE : random() % 3;
        if (random() % 2) p.color = {0.25f * (random() % 5), 1, 0.5f};
    }
    place(scene, placements);
    const auto file = bake_and_open(scene, folder / "a.rpb", 16 << 10);
    // Four materials or none by six colours or none, of which one pair is nothing.
    EXPECT_EQ(file->scene().instance_traits.size(), 4 * 6 - 1u);
    size_t found = 0;
    for (uint32_t block = 0; block < file->scene().blocks.size(); block++) {
        if (file->scene().blocks[block].instances == 0) continue;
        AlignedBytes bytes = read_block(*file, block);
        ASSERT_TRUE(file->check_block(block, bytes.span()).ok()) << file->check_block(block, bytes.span()).message();
        const InstanceBlock view(bytes.span());
        for (size_t i = 0; i < view.records.size(); i++) {
            const uint32_t number = view.records[i].path_high >> RP_INSTANCE_TRAITS_SHIFT;
            const Placement& placed = placements.at(view.numbers[i]);
            ASSERT_EQ(number == 0, placed.material == RP_NONE && placed.color == (Float3{1, 1, 1}));
            found++;
            if (number == 0) continue;
            const rp_instance_traits& t = file->scene().instance_traits.at(number - 1);
            ASSERT_EQ(t.material, placed.material);
            ASSERT_EQ((Float3{t.color[0], t.color[1], t.color[2]}), placed.color);
            ASSERT_EQ(t.first_light, RP_NONE);
        }
    }
    EXPECT_EQ(found, placements.size());
}

// What is not declared by its source.
class Undeclared final : public InstanceSource {
public:
    Status stream(const std::function<Status(std::span<const Placement>)>& take) const override {
        const Placement placed = {.object = 2, .material = 1};
        return take(std::span(&placed, 1));
    }
    uint64_t count() const override { return 1; }
    std::string name() const override { return "undeclared"; }
    uint64_t fingerprint() const override { return 0; }
};

TEST(BakeInstanceTraits, RefusesWhatCannotBe) {
    const auto refused = [](const auto& change) {
        Scene scene = shining_scene();
        scene.materials.push_back(mix_material(RP_NONE, 0, 0.5f));
        change(scene);
        const auto baked = bake(scene, BakeOptions());
        return baked.ok() ? std::string() : baked.status().message();
    };
    const auto one = [](Placement p) { return [p](Scene& scene) { place(scene, {Placement{.object = 2}, p}); }; };
    EXPECT_EQ(refused([](Scene&) {}), "");
    EXPECT_EQ(refused(one(placement(1, Transform::scale(1, 1, 1.01)))),
              "here: instance 1: it stretches a sphere that shines, or a point that does; give these as meshes");
    EXPECT_EQ(refused(one(placement(0, Transform::scale(1, 1, 1.01)))), "");
    for (const float bad : {-0.1f, 1.1f, float(NAN)})
        EXPECT_EQ(refused(one({.object = 2, .color = {1, bad, 1}})), "here: instance 1: its colour must be from 0 to 1");
    EXPECT_EQ(refused(one({.object = 0, .material = 3})),
              "here: instance 1: what shines cannot be cut out, as material 3 is; give it another material");
    EXPECT_EQ(refused(one({.object = 2, .material = 3})), "");
    EXPECT_EQ(refused(one({.object = 2, .material = 4})), "here: material 4 of instances does not exist");
    EXPECT_EQ(refused([](Scene& scene) { scene.instances = {std::make_shared<Undeclared>()}; }),
              "undeclared: instance 0: material 1 of object 2 is not among those that its source says it has");
    // A lamp that is nothing but unseen, so far away that its triangles are, too.
    EXPECT_EQ(refused([](Scene& scene) {
                  std::erase_if(scene.objects[1].shapes, [](const Shape& shape) { return !shape.unseen; });
                  place(scene, {placement(1, Transform::translate(2e12, 0, 0))});
              }),
              "here: instance 0: what shines there is beyond 1000000000000; scale the scene");
}

// An object that is nothing but unseen lights shines where it is placed.
TEST(BakeInstanceTraits, UnseenLightsNeedNothingThatIsSeen) {
    Scene scene = shining_scene();
    std::erase_if(scene.objects[1].shapes, [](const Shape& shape) { return !shape.unseen; });
    place(scene, {placement(1, Transform::scale(2, 2, 1))});
    const auto baked = bake(scene, BakeOptions());
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    const BakedScene& result = baked->blocks.source().scene();
    EXPECT_EQ(result.instances, 0u);
    ASSERT_EQ(result.lights.size(), 2u + 8u);
    for (size_t i = 2; i < 10; i++) EXPECT_TRUE(result.lights[i].flags & RP_LIGHT_UNSEEN);
    EXPECT_TRUE(check_scene(result, UINT64_MAX).ok()) << check_scene(result, UINT64_MAX).message();
}

TEST(BakeInstanceTraits, LightsTakeOnOtherLooks) {
    TemporaryFolder folder;
    const Scene scene = shining_scene();
    const auto first = bake_and_open(scene, folder / "a.rpb", 16 << 10);
    Scene other = scene;
    other.area_lights = {{{5, 5, 5}, true}, {{1, 5, 6}}, {{7, 0, 9}, true, 1.5f}, {{3, 3, 3}, false, 4}};
    other.materials[1].color[0] = 0.9f;
    rp_light distant{};
    distant.kind = RP_LIGHT_DISTANT;
    distant.p[2] = distant.radiance[0] = 1;
    other.lights.push_back(distant);
    EXPECT_EQ(*bake_fingerprint(other, {}), *bake_fingerprint(scene, {}));
    const auto fresh = bake_and_open(other, folder / "b.rpb", 16 << 10);
    BakedScene restyled = first->scene();
    EXPECT_NE(restyled.identity(), fresh->scene().identity());
    const auto done = restyle(other, restyled);
    ASSERT_TRUE(done.ok() && *done);
    EXPECT_EQ(restyled.identity(), fresh->scene().identity());
    const auto back = restyle(scene, restyled);
    ASSERT_TRUE(back.ok() && *back);
    EXPECT_EQ(restyled.identity(), first->scene().identity());
}

// What an instance puts on an object decides what is baked of it: coordinates of textures, and whether rays may pass it.
TEST(BakeInstanceTraits, ObjectsKeepWhatMaterialsOfInstancesNeed) {
    TemporaryFolder folder;
    Scene scene = shining_scene();
    TriangleMesh mesh = terrain(9);
    for (const Float3& p : mesh.positions) mesh.uvs.push_back({p.x, p.z});
    scene.objects[2].shapes = {mesh_shape(mesh)};
    scene.materials.push_back(mix_material(RP_NONE, 0, 0.5f));
    scene.materials.push_back(anisotropic(scene.materials[2], 0.3f));
    const auto flags_with = [&](uint32_t material) {
        place(scene, {{.object = 2}, {.object = 2, .material = material}, {.object = 0}});
        const auto file = bake_and_open(scene, folder / "a.rpb", 16 << 10);
        EXPECT_EQ(file->scene().ranges_of_object(2).size(), 1u);
        EXPECT_EQ(file->scene().ranges_of_object(0)[0].flags, 0u);
        EXPECT_TRUE(check_scene(file->scene(), UINT64_MAX).ok());
        return file->scene().ranges_of_object(2)[0].flags;
    };
    EXPECT_EQ(flags_with(1), 0u);
    EXPECT_EQ(flags_with(3), RP_RANGE_CUTOUT);
    EXPECT_EQ(flags_with(4), RP_RANGE_UV);
    // So a cached file is no longer good where such a material becomes another one.
    place(scene, {{.object = 2, .material = 4}, {.object = 2, .material = 3}});
    const uint64_t before = *bake_fingerprint(scene, {});
    Scene whole = scene, even = scene;
    whole.materials[3] = whole.materials[0];
    even.materials[4] = even.materials[2];
    EXPECT_NE(*bake_fingerprint(whole, {}), before);
    EXPECT_NE(*bake_fingerprint(even, {}), before);
    even = scene;
    even.materials[4].alpha = 0.7f;
    EXPECT_EQ(*bake_fingerprint(even, {}), before);
}

TEST(BakeInstanceTraits, DamagedOnesAreRefused) {
    TemporaryFolder folder;
    const auto file = bake_and_open(shining_scene(), folder / "a.rpb", 16 << 10);
    ASSERT_TRUE(check_scene(file->scene(), file->file_bytes()).ok());
    const auto damaged = [&](const auto& change, const std::string& words) {
        BakedScene scene = file->scene();
        change(scene);
        const std::string message = check_scene(scene, file->file_bytes()).message();
        EXPECT_NE(message.find(words), std::string::npos) << words << ": " << message;
    };
    const std::string section = "section \"instance traits\": those of number 1 ";
    damaged([](BakedScene& s) { s.instance_traits[0].color[1] = 1.5f; }, section + "have no colour");
    damaged([](BakedScene& s) { s.instance_traits[0].color[2] = NAN; }, section + "have no colour");
    damaged([](BakedScene& s) { s.instance_traits[0].material = 3; }, section + "have no material");
    damaged([](BakedScene& s) { s.instance_traits[0].unused = 1; }, section + "have more than there is");
    damaged([](BakedScene& s) { s.instance_traits[0].first_light = RP_NONE; }, section + "have lights that do not exist");
    damaged([](BakedScene& s) { s.instance_traits[0].object = 3; }, section + "are of an object that does not exist");
    damaged([](BakedScene& s) { s.instance_traits[0].first_light = static_cast<rp_u32>(s.lights.size()); },
            section + "have lights that do not exist");
    damaged([](BakedScene& s) { s.instance_traits[0].first_light = 0xfffffff0u; }, section + "have lights that do not exist");
    damaged([](BakedScene& s) { s.instance_traits[0].light_count--; }, section + "have fewer lights than their object");
    damaged([](BakedScene& s) { s.instance_traits[0].first_light = 1; }, section + "have lights of another kind");
    damaged([](BakedScene& s) { s.objects[1].first_range = 0; }, "section \"objects\": the ranges of object 0 are out of order");
    damaged([](BakedScene& s) { s.objects[2].first_range = 99; }, "the ranges of object 2 are out of order");
    damaged([](BakedScene& s) { s.ranges[s.objects[0].first_range + 1].first_light = 5; }, "the lights of object 0 are out of order");
    damaged([](BakedScene& s) { s.ranges[s.objects[2].first_range].flags |= RP_RANGE_CUTOUT; }, "has the wrong flags for its material");
}

}  // namespace
}  // namespace raypager
