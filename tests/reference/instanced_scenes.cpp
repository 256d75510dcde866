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

Scene groves(uint32_t trees, PictureSize size, double scattered, bool berries) {
    SceneBuilder builder(size);
    Scene& scene = builder.scene();
    const uint32_t green = builder.material(diffuse({0.2, 0.5, 0.15})), wood = builder.material(diffuse({0.45, 0.3, 0.2}));
    const uint32_t red = builder.material(conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, 0.2)), sand = builder.material(diffuse({0.7, 0.6, 0.45}));
    Dice dice(11);
    enum : uint32_t { leaf, twig, tree, grove };
    const auto place = [&](std::vector<Placement> placements) {
        scene.objects.back().instances.push_back(std::make_shared<InstancesInMemory>(scene.objects.back().name, std::move(placements)));
    };
    builder.add("leaf", icosphere(0.5, 2, true), green, Transform::translate(0.6, 0, 0) * Transform::scale(1, 0.5, 0.08));
    if (berries) builder.add_sphere("berry", {0.2, 0, -0.2}, 0.12, red);
    take_as_object(scene, 0, "leaf");
    builder.add("stick", box({0, -0.03, -0.03}, {2, 0.03, 0.03}, 2), wood);
    take_as_object(scene, 0, "twig");
    std::vector<Placement> placements;
    for (int i = 0; i < 9; i++) {
        const double size_of_leaf = dice.between(0.25, 0.45);
        placements.push_back(
            placement(leaf, Transform::translate(0.2 * i + 0.2, 0, 0) * Transform::rotate(137.5 * i, 1, 0, 0) * Transform::rotate(60, 0, 0, 1) *
                                Transform::scale(i % 2 ? -size_of_leaf : size_of_leaf, size_of_leaf, 0.3)));
    }
    place(std::move(placements));
    builder.add("trunk", box({-0.12, -0.12, 0}, {0.12, 0.12, 2.2}, 4), wood);
    take_as_object(scene, 0, "tree");
    placements.clear();
    for (int i = 0; i < 14; i++) {
        const double grows = dice.between(0.4, 0.9);
        placements.push_back(placement(twig, Transform::translate(0, 0, 0.8 + 0.1 * i) * Transform::rotate(222.5 * i, 0, 0, 1) *
                                                 Transform::rotate(-35, 0, 1, 0) * Transform::scale(grows, dice.between(0.5, 1), grows)));
    }
    placements.push_back(placement(leaf, Transform::translate(0, 0, 2.2) * Transform::rotate(-90, 0, 1, 0)));
    place(std::move(placements));
    take_as_object(scene, 0, "grove");
    placements.clear();
    for (uint32_t i = 0; i < trees / 3 + 1; i++)
        placements.push_back(placement(tree, random_transform(dice, i % 4, {dice.between(-3, 3), dice.between(-3, 3), 0}, dice.between(0.5, 0.9))));
    place(std::move(placements));

    const Transform far = Transform::translate(scattered, -scattered, 0.5 * scattered);
    placements.clear();
    for (int i = 0; i < 3; i++)
        placements.push_back(placement(
            grove, far * Transform::translate(4 * i - 4, i, 0) * Transform::rotate(100 * i, 0, 0, 1) * Transform::scale(i == 1 ? -1 : 1, 1, 1)));
    for (int i = 0; i < 30; i++)
        placements.push_back(
            placement(static_cast<uint32_t>(i) % 3, far * random_transform(dice, dice.below(5), dice.point(-4, 4), dice.between(0.3, 1))));
    scene.instances.push_back(std::make_shared<InstancesInMemory>("land", std::move(placements)));
    builder.add("ground", quad({-10, -10, 0}, {20, 0, 0}, {0, 20, 0}, 24), sand, far);
    builder.shine(builder.add("lamp", quad({-2, -2, 9}, {0, 4, 0}, {4, 0, 0}), builder.material(absorber()), far), {9, 9, 8});
    builder.infinite_light({0.3, 0.35, 0.4});
    const Vec3 o(scattered, -scattered, 0.5 * scattered);
    builder.camera(o + Vec3(2, -13, 5), o + Vec3(0, 0, 1), {0, 0, 1}, 40);
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

// What sources place, and what that places in turn.
Status write_out(const Scene& scene, const std::vector<std::shared_ptr<const InstanceSource>>& sources, const Transform& around, Scene& out) {
    for (const auto& source : sources) {
        const Status status = source->stream([&](std::span<const Placement> placements) {
            for (const Placement& p : placements) {
                Transform to_world;
                for (size_t i = 0; i < 3; i++) to_world.m[i] = p.to_world[i];
                to_world = around * to_world;
                const Object& object = scene.objects[p.object];
                for (const Shape& shape : object.shapes) {
                    out.shapes.push_back(shape);
                    out.shapes.back().to_world = to_world * shape.to_world;
                    out.shapes.back().material = tinted(out, p.material == RP_NONE ? shape.material : p.material, p.color);
                }
                const Status inside = write_out(scene, object.instances, to_world, out);
                if (!inside.ok()) return inside;
            }
            return Status();
        });
        if (!status.ok()) return status;
    }
    return {};
}

}  // namespace

Scene written_out(const Scene& scene) {
    Scene out = scene;
    out.objects.clear();
    out.instances.clear();
    if (!write_out(scene, scene.instances, {}, out).ok()) out.shapes.clear();
    return out;
}

}  // namespace raypager::reference
