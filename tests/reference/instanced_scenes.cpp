#include "reference/instanced_scenes.hpp"

#include "raypager/materials.hpp"
#include "reference/scene_builder.hpp"

namespace raypager::reference {
namespace {

// What was added to the scene since becomes an object.
void take_as_object(Scene& scene, size_t first_shape, const char* name) {
    Object object{name, {}};
    for (size_t i = first_shape; i < scene.shapes.size(); i++) object.shapes.push_back(std::move(scene.shapes[i]));
    scene.shapes.resize(first_shape);
    scene.objects.push_back(std::move(object));
}

Placement placement(uint32_t object, const Transform& to_world) {
    Placement result{object, {}};
    for (size_t i = 0; i < 3; i++) result.to_world[i] = to_world.m[i];
    return result;
}

// Of a kind that goes with the number: turned and scaled evenly, mirrored, uneven, sheared, tiny.
Transform random_transform(Dice& dice, uint32_t kind, const Vec3& place, double size) {
    Transform form = Transform::scale(size, size, size);
    if (kind == 1) form = Transform::scale(-size, size, size);
    if (kind == 2) form = Transform::scale(0.3 * size, size, 2 * size);
    if (kind == 3) {
        form.m[0][1] = 0.7 * size;
        form.m[2][0] = -0.4 * size;
    }
    if (kind == 4) form = Transform::scale(1e-3 * size, 1e-3 * size, 1e-3 * size);
    const Vec3 axis = normalized(dice.point(-1, 1) + Vec3(0, 0, 1.1));
    return Transform::translate(place.x, place.y, place.z) * Transform::rotate(dice.between(0, 360), axis.x, axis.y, axis.z) * form;
}

}  // namespace

Scene strewn(uint32_t instances, PictureSize size, bool round) {
    SceneBuilder builder(size);
    Scene& scene = builder.scene();
    const uint32_t clay = builder.material(diffuse({0.7, 0.5, 0.4})), steel = builder.material(conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, 0.1));
    const uint32_t clear = builder.material(glass(1.5)), white = builder.material(diffuse(Vec3(0.8)));
    // Middles of objects lie elsewhere than their origins.
    builder.add("ball", icosphere(0.5, 3, true), steel, Transform::translate(3, -2, 1));
    builder.add("foot", box({2.6, -2.4, 0.2}, {3.4, -1.6, 0.5}, 3), clay);
    take_as_object(scene, 0, "ball on a foot");
    builder.add("ring", torus(0.6, 0.2, 60, 40, true), clay);
    builder.add("core", icosphere(0.3, 2), clear);
    take_as_object(scene, 0, "ring");
    builder.add_sphere("left", {-0.4, 0, 0}, 0.35, clear);
    builder.add_sphere("right", {0.4, 0, 0}, 0.3, steel);
    take_as_object(scene, 0, "dumb-bell");
    Dice dice(5);
    std::vector<CloudPoint> points;  // which have radii of their own in the world, so that copies of them are not alike
    for (int i = 0; i < 400; i++) points.push_back({normalized(dice.point(-1, 1)).to_float(), 0.05f, dice.below(0x1000000)});
    builder.add_points("dandelion", std::move(points), true, white);
    if (round)
        scene.shapes.clear();
    else
        take_as_object(scene, 0, "dandelion");

    builder.add("floor", quad({-4, -4, -0.6}, {8, 0, 0}, {0, 8, 0}, 24), white);
    builder.add_sphere("once", {0, 0, 0.4}, 0.9, steel);
    std::vector<Placement> placements;
    for (uint32_t i = 0; i < instances; i++) {
        const uint32_t object = round ? i % 3 : i % 4, kind = object >= 2 && round ? dice.below(2) : dice.below(5);
        const Vec3 place(dice.between(-3.5, 3.5), dice.between(-3.5, 3.5), dice.between(-0.4, 1.2));
        placements.push_back(placement(object, random_transform(dice, kind, place, i == 7 ? 3 : dice.between(0.15, 0.6))));
    }
    // One right within another of its kind, and one twice.
    placements.push_back(placements[1]);
    placements.push_back(placements[0]);
    const auto middle = static_cast<std::ptrdiff_t>(placements.size() / 2);
    scene.instances.push_back(std::make_shared<InstancesInMemory>("first", std::vector(placements.begin(), placements.begin() + middle)));
    scene.instances.push_back(std::make_shared<InstancesInMemory>("second", std::vector(placements.begin() + middle, placements.end())));
    builder.shine(builder.add("lamp", quad({-1, -1, 4}, {0, 2, 0}, {2, 0, 0}), builder.material(absorber())), {7, 7, 6});
    builder.infinite_light({0.3, 0.35, 0.4});
    builder.camera({0.5, -6, 3}, {0, 0, 0.2}, {0, 0, 1}, 45);
    return builder.finish();
}

namespace {

struct LanternMaterials {
    uint32_t clay, coat, speckled, dark, leaf;
};

LanternMaterials add_lanterns(SceneBuilder& builder) {
    Scene& scene = builder.scene();
    LanternMaterials m = {};
    m.clay = builder.material(diffuse({0.7, 0.5, 0.4}));
    m.coat = builder.material(coated_diffuse_material({0.3f, 0.6f, 0.8f}, 1.5f, 0.1f));
    m.speckled = builder.material(mix_material(m.clay, m.coat, 0.4f));
    m.dark = builder.material(absorber());
    m.leaf = builder.material(translucent_material({0.2f, 0.5f, 0.1f}, {0.5f, 0.4f, 0.1f}));
    builder.add("frame", torus(0.8, 0.12, 40, 20, true), m.clay);
    builder.shine(builder.add("glow", icosphere(0.35, 1), m.dark), {9, 6, 3});
    builder.shine(builder.add("sheet", quad({-0.4, -0.4, 0.7}, {0.8, 0, 0}, {0, 0.8, 0}, 2), m.clay), {2, 4, 8}, true);
    scene.area_lights.back().power = 3;
    Shape& unseen = builder.add("unseen", quad({-0.3, -0.3, -0.9}, {0, 0.6, 0}, {0.6, 0, 0}), m.dark);
    builder.shine(unseen, {8, 8, 8});
    unseen.unseen = true;
    take_as_object(scene, 0, "lantern");
    builder.add("foot", box({0.8, -0.2, -0.7}, {1.2, 0.2, -0.4}, 3), m.coat);
    builder.shine(builder.add_sphere("bulb", {1, 0, 0}, 0.35, m.dark), {6, 6, 5});
    take_as_object(scene, 0, "bulb");
    builder.add("leaves", torus(0.5, 0.35, 50, 30), m.leaf);
    take_as_object(scene, 0, "leaves");
    return m;
}

}  // namespace

Scene strewn_lanterns(uint32_t instances, PictureSize size) {
    SceneBuilder builder(size);
    Scene& scene = builder.scene();
    const LanternMaterials m = add_lanterns(builder);
    Dice dice(9);
    std::vector<Placement> placements;
    for (uint32_t i = 0; i < instances; i++) {
        const uint32_t object = i % 3, kind = object == 1 ? dice.below(2) : dice.below(4);
        const Vec3 place(dice.between(-3.5, 3.5), dice.between(-3.5, 3.5), dice.between(-0.2, 1.5));
        Placement placed = placement(object, random_transform(dice, kind, place, dice.between(0.2, 0.6)));
        const uint32_t others[] = {RP_NONE, m.speckled, m.coat, m.leaf};
        placed.material = others[dice.below(4)];
        if (dice.below(2) == 0) placed.color = dice.point(0.2, 1).to_float();
        placements.push_back(placed);
    }
    scene.instances.push_back(std::make_shared<InstancesInMemory>("lanterns", std::move(placements)));
    builder.add("floor", quad({-4, -4, -0.6}, {8, 0, 0}, {0, 8, 0}, 60), builder.material(diffuse(Vec3(0.6))));
    builder.shine(builder.add("lamp", quad({-1, -1, 4}, {0, 2, 0}, {2, 0, 0}), m.dark), {2, 2, 2});
    builder.point_light({2, -3, 2}, {3, 3, 4});
    builder.infinite_light({0.05, 0.06, 0.08});
    builder.camera({0.5, -6, 3}, {0, 0, 0.2}, {0, 0, 1}, 45);
    return builder.finish();
}

namespace {

// The material with what is diffuse of it times a colour, by its number.
uint32_t tinted(Scene& scene, uint32_t number, const Float3& color) {
    if (number == RP_NONE || color == Float3{1, 1, 1}) return number;
    rp_material material = scene.materials[number];
    if (material.kind == RP_MATERIAL_MIX) {
        material.first = tinted(scene, material.first, color);
        material.second = tinted(scene, material.second, color);
    } else {
        const float by[3] = {color.x, color.y, color.z};
        for (int i = 0; i < 3; i++) material.color[i] *= by[i], material.transmittance[i] *= by[i];
    }
    scene.materials.push_back(material);
    return static_cast<uint32_t>(scene.materials.size() - 1);
}

}  // namespace

Scene written_out(const Scene& scene) {
    Scene out = scene;
    out.objects.clear();
    out.instances.clear();
    for (const auto& source : scene.instances) {
        const Status status = source->stream([&](std::span<const Placement> placements) {
            for (const Placement& p : placements) {
                Transform to_world;
                for (size_t i = 0; i < 3; i++) to_world.m[i] = p.to_world[i];
                for (const Shape& shape : scene.objects[p.object].shapes) {
                    out.shapes.push_back(shape);
                    out.shapes.back().to_world = to_world * shape.to_world;
                    out.shapes.back().material = tinted(out, p.material == RP_NONE ? shape.material : p.material, p.color);
                }
            }
            return Status();
        });
        if (!status.ok()) out.shapes.clear();
    }
    return out;
}

}  // namespace raypager::reference
