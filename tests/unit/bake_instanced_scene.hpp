// A scene with instances, and what a block of them holds.
#pragma once

#include <cstring>
#include <numeric>

#include "raypager/abi/instance.h"
#include "unit/bake_scenes.hpp"

namespace raypager::blocks_test {

inline Placement placement(uint32_t object, const Transform& to_world) {
    Placement placed;
    placed.object = object;
    for (size_t i = 0; i < 3; i++) placed.to_world[i] = to_world.m[i];
    return placed;
}

inline Transform transform_of(const Placement& placement) {
    Transform to_world;
    for (size_t i = 0; i < 3; i++) to_world.m[i] = placement.to_world[i];
    return to_world;
}

// Turned, stretched, some mirrored.
inline std::vector<Placement> random_placements(uint32_t count, uint32_t objects, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-50, 50), turn(0, 360), size(0.2, 2);
    std::vector<Placement> placements;
    for (uint32_t i = 0; i < count; i++) {
        const double x = place(random), y = place(random), z = place(random), sign = i % 5 == 0 ? -1 : 1;
        placements.push_back(placement(i % objects, Transform::translate(x, y, z) * Transform::rotate(turn(random), x, 1, z) *
                                                        Transform::scale(sign * size(random), size(random), size(random))));
    }
    return placements;
}

// Two objects, the first with two shapes, the second with more triangles than a block of 16 KiB holds, far from the middle of its space; and shapes
// of the scene's own. Instances come from two sources.
inline Scene instanced_scene(uint32_t instances = 1000) {
    Scene scene = scene_of({mesh_shape(icosphere(2)), sphere_shape({0, 3, 0}, 0.5f)});
    scene.materials.push_back(gray());
    scene.objects.resize(2);
    scene.objects[0] = {"pebble", {mesh_shape(icosphere(1)), sphere_shape({1, 1, 0}, 0.25f)}};
    scene.objects[0].shapes[1].material = 1;
    scene.objects[1] = {"sheet", {mesh_shape(terrain(60, true))}};
    scene.objects[1].shapes[0].to_world = Transform::translate(7, 0, -9);
    const std::vector<Placement> all = random_placements(instances, 2, 77);
    const auto middle = all.begin() + instances / 3;
    scene.instances = {std::make_shared<InstancesInMemory>("first", std::vector(all.begin(), middle)),
                       std::make_shared<InstancesInMemory>("second", std::vector(middle, all.end()))};
    return scene;
}

struct InstanceBlock {
    explicit InstanceBlock(std::span<const std::byte> bytes) {
        std::memcpy(&header, bytes.data(), sizeof header);
        const auto take = [&](auto& items, size_t at, size_t count) {
            items.resize(count);
            if (count > 0) std::memcpy(items.data(), bytes.data() + at, count * sizeof items[0]);
        };
        take(nodes, header.nodes_at, header.node_count);
        take(records, header.leaves_at, header.leaf_count);
        take(numbers, header.leaves_at + header.leaf_count * sizeof(rp_instance), header.leaf_count);
    }
    rp_block_header header;
    std::vector<rp_node> nodes;
    std::vector<rp_instance> records;
    std::vector<rp_u32> numbers;
};

inline uint64_t path_of(const rp_instance& record) { return uint64_t{record.path_high} << 32 | record.path_low; }

}  // namespace raypager::blocks_test
