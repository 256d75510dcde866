// Block files. Inputs are squeezed (tests/support/block_file_bytes.hpp), and checksums and sizes are made right before a try: what
// stands behind them must be checked as well. Whatever passes all checks is decoded, which must not lead outside.
#include <cstring>

#include "base/check.hpp"
#include "block/decode.hpp"
#include "block/wide_block.hpp"
#include "fuzz/fuzz.hpp"
#include "store/block_file.hpp"
#include "store/format.hpp"
#include "support/block_file_bytes.hpp"
#include "support/temporary_folder.hpp"
#include "texture/texture_words.hpp"
#include "unit/bake_instanced_scene.hpp"

namespace raypager::fuzz {
namespace {

// Each record is there once, as the check has found.
void decode_instances(const BakedScene& scene, uint32_t block, std::span<const std::byte> stored) {
    const blocks_test::InstanceBlock view(stored);
    RAYPAGER_CHECK(view.records.size() == scene.blocks[block].instances);
    for (const rp_instance& record : view.records) RAYPAGER_CHECK(record.object < scene.objects.size());
}

void decode_block(const BakedScene& scene, uint32_t block, std::span<const std::byte> stored) {
    const BlockView view(stored);
    uint64_t primitives = 0;
    for (const rp_block_entry& block_entry : scene.block_entries) {
        if (block_entry.block != block) continue;
        const DecodedLeaf leaf = decode_subtree(view, block_entry.root);
        primitives += leaf.triangles.size() + leaf.spheres.size();
    }
    RAYPAGER_CHECK(primitives == uint64_t{scene.blocks[block].triangles} + scene.blocks[block].spheres);
}

}  // namespace

std::vector<std::string> seeds() {
    using namespace blocks_test;
    std::vector<Scene> scenes = {scene_of({mesh_shape(terrain(3, true)), sphere_shape({0, 1, 0}, 0.1f)}), scene_of({mesh_shape(soup(150, 1))}),
                                 scene_of({}), scene_of({}), scene_of({sphere_shape({0, 1, 0}, 0.1f)})};
    // A program, but no image: pages are larger than inputs are.
    scenes[3].texture_maps.resize(1);
    scenes[3].texture_ops = {{RP_TEXTURE_CONSTANT, 0, 0, 0, {1, 0, 0, 0}, {}},
                             {RP_TEXTURE_UV, 0, 0, 0, {}, {}},
                             {RP_TEXTURE_CHECKS, 0, 0, RP_NONE, {}, {}},
                             {RP_TEXTURE_SET | RP_TEXTURE_LAST, RP_PARAMETER_COLOR, 0, 0, {}, {}}};
    scenes[3].materials[0].flags |= 1u << RP_MATERIAL_PROGRAM_SHIFT;
    scenes[4].objects = {{"a", {mesh_shape(terrain(2))}}, {"b", {sphere_shape({1, 0, 0}, 1)}}};
    scenes[4].instances = {std::make_shared<InstancesInMemory>("here", random_placements(9, 2, 1))};
    scenes[0].area_lights = {{{5, 5, 5}, false}};
    scenes[0].shapes[1].area_light = 0;
    std::vector<std::string> result;
    for (const float position_error : {0.0f, 1e-3f})
        for (const Scene& scene : scenes) {
            const std::filesystem::path path = scratch_path("seed.rpb");
            BakeOptions options;
            options.block_bytes = 16 << 10;
            options.block_entries = 4;
            options.position_error = position_error;
            RAYPAGER_CHECK(bake(scene, options, path).ok());
            result.push_back(support::squeeze_pages(support::read_file(path)));
        }
    return result;
}

void run(std::string_view input) {
    std::string bytes = support::spread_pages(input);
    if (bytes.size() < sizeof(format::Header)) return;
    format::Header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    header.file_bytes = bytes.size();
    std::memcpy(bytes.data(), &header, sizeof header);
    support::seal_block_file(bytes);
    const auto file = BlockFile::open(write_input("input.rpb", bytes));
    if (!file) return RAYPAGER_CHECK(file.status().message().find("input.rpb") != std::string::npos);
    const BakedScene& scene = (*file)->scene();
    for (uint32_t page = 0; page < scene.pages.size(); page++) {
        std::vector<std::byte> texels(RP_TEXTURE_PAGE_BYTES);
        (void)(*file)->read_page(page, texels);
    }
    (void)texture_words(scene);
    RAYPAGER_CHECK(scene.texel_words() <= 2 * scene.texture_ops.size());
    for (uint32_t block = 0; block < scene.blocks.size(); block++) {
        std::vector<std::byte> stored(scene.blocks[block].stored_bytes);
        if (!(*file)->read_block(block, stored) || !(*file)->check_block(block, stored)) continue;
        if (scene.blocks[block].instances > 0) {
            decode_instances(scene, block, stored);
            continue;
        }
        decode_block(scene, block, stored);
        (void)WideBlockMaker().make(stored, scene.block_entries_of(block).roots);
    }
}

}  // namespace raypager::fuzz
