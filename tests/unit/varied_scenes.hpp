// Small scenes that have between them all that a block file can hold, baked into several blocks each, for tests that change fields of files.
#pragma once

#include "base/check.hpp"
#include "raypager/sky.hpp"
#include "support/small_scene.hpp"
#include "support/textured_scene.hpp"
#include "unit/bake_instanced_scene.hpp"

namespace raypager::blocks_test {

// Objects of triangles and spheres, one of which shines, placed in the world; cut-outs, textures in pages, vertices with all attributes, coloured
// points, a sky in pages, and every kind of material and light that small_scene() has.
inline Scene scene_of_everything() {
    Scene scene = support::small_scene(10, true);
    scene.images = {support::random_image({70, 40, 4, TexelKind::unsigned_8, true}, 1), support::random_image({9, 9, 1, TexelKind::half, false}, 2)};
    scene.texture_maps = {{RP_MAP_UV, 0, {}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}, {1, 1}, {0, 0}}};
    support::add_image_program(scene, {0, 1});
    rp_material cut_out = {};
    cut_out.kind = RP_MATERIAL_MIX;
    cut_out.first = RP_NONE;
    cut_out.second = 1;
    cut_out.amount = 0.5f;
    scene.materials.push_back(cut_out);
    Shape leaves = mesh_shape(soup(60, 3));
    leaves.material = static_cast<uint32_t>(scene.materials.size() - 1);
    scene.shapes.push_back(leaves);
    scene.objects = {{"pebble", {mesh_shape(icosphere(1)), sphere_shape({1, 1, 0}, 0.25f)}}, {"lamp", {mesh_shape(icosphere(0))}}};
    scene.objects[1].shapes[0].area_light = 0;
    std::vector<Placement> placements = random_placements(12, 2, 5);
    for (size_t i = 0; i < placements.size(); i += 3) placements[i].color = {0.5f, 1, 0.25f};
    scene.instances = {std::make_shared<InstancesInMemory>("placements", std::move(placements))};
    RAYPAGER_CHECK(set_sky(scene, {40, 40, 3, std::vector<float>(4800, 0.5f)}).ok());
    return scene;
}

// Instances in instances.
inline Scene nested_scene() {
    Scene scene = support::small_scene(6);
    scene.objects = {{"leaf", {mesh_shape(icosphere(1))}}, {"branch", {sphere_shape({0, 0, 0}, 0.5f)}}, {"tree", {}}};
    for (uint32_t level = 1; level < 3; level++)
        scene.objects[level].instances = {std::make_shared<InstancesInMemory>("placements", random_placements(5, level, level))};
    scene.instances = {std::make_shared<InstancesInMemory>("placements", random_placements(7, 3, 4))};
    return scene;
}

struct VariedFile {
    Scene scene;
    BakeOptions options;
};

inline std::vector<VariedFile> varied_files() {
    std::vector<VariedFile> files = {
        {scene_of_everything(), {}}, {nested_scene(), {}}, {support::small_scene(24), {}}, {support::small_scene(30), {}}};
    for (VariedFile& file : files) {
        file.options.block_bytes = 16 << 10;
        file.options.block_entries = 4;
    }
    files[0].options.resident_sky_bytes = 0;
    files[0].options.scattered_sky_size = 20;
    files[0].options.flatten_limit = files[1].options.flatten_limit = 0;  // few as they are, instances stay
    files[2].options.position_error = 1e-3f;
    return files;
}

}  // namespace raypager::blocks_test
