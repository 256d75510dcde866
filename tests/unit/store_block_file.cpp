// What is written into a block file is read again; what must not be believed is refused.
#include <gtest/gtest.h>

#include <cstring>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "blocks/gather.hpp"
#include "store/format.hpp"
#include "unit/blocks_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

TEST(BlockFile, RoundTrip) {
    TemporaryFolder folder;
    Scene scene = scene_of({mesh_shape(terrain(30)), sphere_shape({0, 1, 0}, 0.1f)});
    scene.camera.eye = {1, 2, 3};
    scene.width = 321;
    scene.height = 123;
    scene.spp = 7;
    scene.max_depth = 0;
    scene.film = {.exposure = 3, .color_matrix = {1, 2, 3, 4, 5, 6, 7, 8, 9}, .max_luminance = 10};
    scene.area_lights = {{{5, 5, 5}, false}};
    scene.shapes[1].area_light = 0;
    const auto file = bake_and_open(scene, folder / "a.rpb", 16 << 10);
    const BakedScene& baked = file->scene();
    const auto gathered = gather(scene, [](double) {});
    ASSERT_TRUE(gathered.ok());
    EXPECT_EQ(baked.camera.eye, scene.camera.eye);
    EXPECT_EQ(baked.width, 321u);
    EXPECT_EQ(baked.height, 123u);
    EXPECT_EQ(baked.spp, 7u);
    EXPECT_EQ(baked.max_depth, 0u);
    EXPECT_EQ(baked.film, scene.film);
    EXPECT_EQ(baked.triangles, 1800u);
    EXPECT_EQ(baked.spheres, 1u);
    EXPECT_TRUE(same_bytes(baked.materials, scene.materials));
    EXPECT_TRUE(same_bytes(baked.lights, gathered->lights));
    EXPECT_TRUE(same_bytes(baked.ranges, gathered->ranges));
    EXPECT_GT(baked.blocks.size(), 1u);
    EXPECT_EQ(baked.fingerprint, *bake_fingerprint(scene, [] {
                  BakeOptions options;
                  options.block_bytes = 16 << 10;
                  return options;
              }()));
    uint32_t largest_stored = 0, largest_wide = 0;
    for (const BlockRecord& block : baked.blocks) {
        largest_stored = std::max(largest_stored, block.stored_bytes);
        largest_wide = std::max(largest_wide, block.wide_bytes);
    }
    EXPECT_EQ(baked.largest_block(BlockForm::stored), largest_stored);
    EXPECT_EQ(baked.largest_block(BlockForm::wide), largest_wide);
    EXPECT_EQ(file->file_bytes(), std::filesystem::file_size(folder / "a.rpb"));
}

TEST(BlockFile, IdentityIsThatOfThePicture) {
    TemporaryFolder folder;
    Scene scene = scene_of({mesh_shape(terrain(30))});
    const uint64_t identity = bake_and_open(scene, folder / "a.rpb", 1 << 20)->scene().identity();
    scene.spp = 65;
    EXPECT_NE(bake_and_open(scene, folder / "b.rpb", 1 << 20)->scene().identity(), identity);
    scene.spp = 64;
    EXPECT_EQ(bake_and_open(scene, folder / "c.rpb", 1 << 20)->scene().identity(), identity);
    scene.shapes[0].to_world = Transform::translate(0, 0, 1e-6);
    EXPECT_NE(bake_and_open(scene, folder / "d.rpb", 1 << 20)->scene().identity(), identity);
}

TEST(BlockFile, FingerprintFollowsInputsAndOptions) {
    TemporaryFolder folder;
    Scene scene = scene_of({mesh_shape(terrain(5))});
    ASSERT_TRUE(write_text(folder / "scene.pbrt", "x").ok());
    scene.files = {(folder / "scene.pbrt").string()};
    BakeOptions options;
    const auto first = bake_fingerprint(scene, options);
    ASSERT_TRUE(first.ok()) << first.status().message();
    EXPECT_EQ(*bake_fingerprint(scene, options), *first);
    options.block_bytes++;
    EXPECT_NE(*bake_fingerprint(scene, options), *first);
    options.block_bytes--;
    ASSERT_TRUE(write_text(folder / "scene.pbrt", "xy").ok());
    EXPECT_NE(*bake_fingerprint(scene, options), *first);
    scene.files = {(folder / "absent.pbrt").string()};
    const auto absent = bake_fingerprint(scene, options);
    ASSERT_FALSE(absent.ok());
    EXPECT_NE(absent.status().message().find("absent.pbrt"), std::string::npos);
}

TEST(BlockFile, NothingUnderItsNameUntilFinished) {
    TemporaryFolder folder;
    {
        auto writer = BlockFileWriter::create(folder / "a.rpb");
        ASSERT_TRUE(writer.ok());
        BlockRecord record;
        ASSERT_TRUE(writer->append(std::vector<std::byte>(1000), record).ok());
        EXPECT_EQ(record.offset, format::page);
        EXPECT_FALSE(std::filesystem::exists(folder / "a.rpb"));
    }
    EXPECT_TRUE(std::filesystem::is_empty((folder / "a.rpb").parent_path()));
}

TEST(BakeOptionsCheck, RefusesImpossibleSizes) {
    TemporaryFolder folder;
    const Scene scene = scene_of({mesh_shape(terrain(5))});
    BakeOptions options;
    options.block_bytes = 1000;
    EXPECT_EQ(bake(scene, options, folder / "a.rpb").status().kind(), ErrorKind::usage);
    options.block_bytes = uint64_t{1} << 40;
    EXPECT_FALSE(bake(scene, options, folder / "a.rpb").ok());
    options = {};
    options.sub_boxes = 0;
    EXPECT_FALSE(bake(scene, options, folder / "a.rpb").ok());
    EXPECT_FALSE(bake(scene, {}, folder / "no/such/folder/a.rpb").ok());
}

}  // namespace
}  // namespace raypager
