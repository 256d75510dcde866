// What is written into a block file is read again; what must not be believed is refused.
#include <gtest/gtest.h>

#include <cstring>

#include "bake/restyle.hpp"
#include "base/files.hpp"
#include "base/hash.hpp"
#include "gather/gather.hpp"
#include "raypager/import.hpp"
#include "store/format.hpp"
#include "unit/bake_scenes.hpp"

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
    scene.camera.lens_radius = 0.5f;
    scene.camera.focal_distance = 9;
    scene.camera.projection = Projection::orthographic;
    scene.camera.window = {0.25f, 0.5f, 0.75f, 0.125f};
    scene.filter = {PixelFilter::Kind::mitchell, 2, 3, 0.5f, 0.25f};
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
    EXPECT_EQ(baked.camera, scene.camera);
    EXPECT_EQ(baked.filter, scene.filter);
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
    scene.filter.radius_x = 1;
    EXPECT_NE(bake_and_open(scene, folder / "e.rpb", 1 << 20)->scene().identity(), identity);
    scene.filter = {};
    scene.camera.lens_radius = 1;
    EXPECT_NE(bake_and_open(scene, folder / "f.rpb", 1 << 20)->scene().identity(), identity);
    scene.camera.lens_radius = 0;
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
    // What the scene file says of geometry counts, not that it was edited.
    ASSERT_TRUE(write_text(folder / "scene.pbrt", "xy").ok());
    EXPECT_EQ(*bake_fingerprint(scene, options), *first);
    scene.shapes.push_back(mesh_shape(terrain(6)));
    EXPECT_NE(*bake_fingerprint(scene, options), *first);
    scene.shapes.pop_back();
    scene.shapes[0].to_world = Transform::translate(0, 0, 1e-6);
    EXPECT_NE(*bake_fingerprint(scene, options), *first);
}

// A file's size and time stand for what is in it.
TEST(BlockFile, FingerprintFollowsTheFilesOfMeshes) {
    TemporaryFolder folder;
    ASSERT_TRUE(write_text(folder / "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").ok());
    const auto scene = import_scene({folder / "a.off"});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    const auto first = bake_fingerprint(*scene, {});
    ASSERT_TRUE(first.ok());
    ASSERT_TRUE(write_text(folder / "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0.5\n3 0 1 2\n").ok());
    EXPECT_NE(*bake_fingerprint(*scene, {}), *first);
    std::filesystem::remove(folder / "a.off");
    const auto absent = bake_fingerprint(*scene, {});
    ASSERT_FALSE(absent.ok());
    EXPECT_NE(absent.status().message().find("a.off"), std::string::npos);
}

// Materials, lights, camera and settings are no geometry. Files that only differ in these have the same blocks, and the one takes on the other's
// looks to the last bit.
TEST(BlockFile, LooksAreNoReasonToBakeAgain) {
    TemporaryFolder folder;
    Scene scene = scene_of({mesh_shape(terrain(10)), mesh_shape(terrain(4)), mesh_shape(terrain(3)), mesh_shape(terrain(2))});
    scene.materials.resize(3);
    scene.area_lights = {{{1, 2, 3}, false}, {{0, 0, 0}, true}, {{5, 5, 5}, true}};
    scene.shapes[1].area_light = 2;
    scene.shapes[2].area_light = 1;
    scene.shapes[3].area_light = 0;
    scene.lights.resize(1);
    scene.lights[0].kind = RP_LIGHT_INFINITE;
    scene.lights[0].radiance[1] = 1;
    // A lamp that is not seen.
    scene.shapes.push_back(mesh_shape(terrain(1)));
    scene.shapes.back().area_light = 0;
    scene.shapes.back().unseen = true;
    const auto first = bake_and_open(scene, folder / "a.rpb", 1 << 20);
    Scene other = scene;
    other.materials[1].color[0] = 0.25f;
    other.area_lights[2] = {{0.5f, 7, 1}, false};
    other.area_lights[0] = {{9, 8, 7}, true};
    other.lights[0].radiance[0] = 40;
    rp_light distant{};
    distant.kind = RP_LIGHT_DISTANT;
    distant.p[2] = distant.radiance[0] = 1;
    other.lights.push_back(distant);
    other.camera.eye.x = 9;
    other.width = 77, other.spp = 5, other.max_depth = 2;
    EXPECT_EQ(*bake_fingerprint(other, {}), *bake_fingerprint(scene, {}));
    const auto fresh = bake_and_open(other, folder / "b.rpb", 1 << 20);
    BakedScene restyled = first->scene();
    EXPECT_NE(restyled.identity(), fresh->scene().identity());
    const auto done = restyle(other, restyled);
    ASSERT_TRUE(done.ok() && *done);
    EXPECT_EQ(restyled.identity(), fresh->scene().identity());
    // Whether something shines at all decides which lights there are.
    other.area_lights[1].radiance.x = 1;
    EXPECT_NE(*bake_fingerprint(other, {}), *bake_fingerprint(scene, {}));
}

// The ground under a bare mesh is not what the scene shows.
TEST(BlockFile, BoundsLeaveBackdropsOut) {
    TemporaryFolder folder;
    Scene scene = scene_of({mesh_shape(terrain(5)), mesh_shape(terrain(5))});
    const auto before = bake_and_open(scene, folder / "a.rpb", 1 << 20);
    scene.shapes[1].to_world = Transform::scale(100, 100, 100);
    scene.shapes[1].backdrop = true;
    const auto file = bake_and_open(scene, folder / "b.rpb", 1 << 20);
    for (size_t a = 0; a < 3; a++) {
        EXPECT_EQ(file->scene().lower[a], before->scene().lower[a]);
        EXPECT_EQ(file->scene().upper[a], before->scene().upper[a]);
    }
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
    options.block_entries = 0;
    EXPECT_FALSE(bake(scene, options, folder / "a.rpb").ok());
    EXPECT_FALSE(bake(scene, {}, folder / "no/such/folder/a.rpb").ok());
}

}  // namespace
}  // namespace raypager
