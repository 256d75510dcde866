// Skies in block files: which are paged, what is said of them there, and what a cached file is still good for.
#include <gtest/gtest.h>

#include "bake/paged_sky.hpp"
#include "lights/image_words.hpp"
#include "raypager/sky.hpp"
#include "scene/light_images.hpp"
#include "support/textured_scene.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

Image graded_sky(uint32_t size, float first = 1) {
    Image image{size, size, 3, {}};
    for (uint32_t i = 0; i < 3 * size * size; i++) image.values.push_back(first + static_cast<float>(i % 29));
    return image;
}

Scene under_sky(Scene scene, uint32_t size = 200, float first = 1) {
    EXPECT_TRUE(set_sky(scene, graded_sky(size, first)).ok());
    return scene;
}

Scene terrain_under_sky() { return under_sky(scene_of({mesh_shape(terrain(20))})); }

BakeOptions all_paged() {
    BakeOptions options;
    options.block_bytes = 16 << 10;
    options.resident_sky_bytes = 0;
    options.scattered_sky_size = 60;
    return options;
}

BakedScene bake_in_memory(const Scene& scene, const BakeOptions& options) {
    const auto baked = bake(scene, options);
    if (!baked.ok()) throw std::runtime_error(baked.status().message());
    return baked->blocks.source().scene();
}

TEST(BakeSkies, LargeOnesArePaged) {
    BakeOptions options;
    EXPECT_FALSE(paged_sky(scene_of({}), options));
    const Scene scene = under_sky(scene_of({}), 100);
    EXPECT_FALSE(paged_sky(scene, options));
    options.resident_sky_bytes = 8 * 100 * 100;
    EXPECT_FALSE(paged_sky(scene, options));
    options.resident_sky_bytes--;
    ASSERT_TRUE(paged_sky(scene, options));
    EXPECT_EQ(paged_sky(scene, options)->level, 0u);
    options.scattered_sky_size = 25;
    EXPECT_EQ(paged_sky(scene, options)->level, 2u);
    options.scattered_sky_size = 24;
    EXPECT_EQ(paged_sky(scene, options)->level, 3u);
    options.scattered_sky_size = 0;  // the coarsest
    EXPECT_EQ(paged_sky(scene, options)->level, 7u);
    // What a lamp shines through has to be there.
    Scene shared = scene;
    rp_light lamp = shared.lights[0];
    lamp.kind = RP_LIGHT_POINT;
    shared.lights.push_back(lamp);
    EXPECT_FALSE(paged_sky(shared, options));
}

TEST(BakeSkies, LieBehindTheImagesOfTextures) {
    const BakedScene plain = bake_in_memory(terrain_under_sky(), all_paged());
    ASSERT_TRUE(plain.has_paged_sky());
    EXPECT_TRUE(plain.has_textures());
    EXPECT_EQ(plain.texel_words(), 0u);
    EXPECT_EQ(plain.images.size(), 1u);
    const Scene textured = under_sky(support::with_images(scene_of({mesh_shape(terrain(20))})));
    const BakedScene baked = bake_in_memory(textured, all_paged());
    ASSERT_EQ(baked.images.size(), 6u);
    EXPECT_EQ(baked.images[5].format, rp_u32{RP_TEXEL_SKY});
    EXPECT_EQ(baked.sky_words[RP_IMAGE_IN_PAGES], 5u);
    EXPECT_EQ(baked.sky_words[RP_IMAGE_WIDTH], 200u);
    EXPECT_EQ(baked.sky_words[RP_IMAGE_LEVEL], 2u);
    EXPECT_EQ(baked.image_levels[baked.images[5].first_level].width, 200u);
    EXPECT_TRUE(are_sky_words(baked.sky_words));
    // The table is there, the texels are not.
    EXPECT_TRUE(baked.light_images[0]->texels.empty());
    EXPECT_EQ(image_words_bytes(baked.light_images, baked.lights, baked.sky_words), 4 * (RP_IMAGE_HEAD + 50 + 50 * 50));
}

TEST(BakeSkies, CountForIdentityAndFingerprint) {
    const Scene scene = terrain_under_sky(), other = under_sky(scene_of({mesh_shape(terrain(20))}), 200, 2);
    BakeOptions coarser = all_paged(), resident;
    coarser.scattered_sky_size = 20;
    EXPECT_NE(bake_in_memory(scene, all_paged()).identity(), bake_in_memory(other, all_paged()).identity());
    EXPECT_NE(bake_in_memory(scene, all_paged()).identity(), bake_in_memory(scene, coarser).identity());
    EXPECT_NE(*bake_fingerprint(scene, all_paged()), *bake_fingerprint(other, all_paged()));
    EXPECT_NE(*bake_fingerprint(scene, all_paged()), *bake_fingerprint(scene, coarser));
    EXPECT_EQ(*bake_fingerprint(scene, resident), *bake_fingerprint(other, resident));
}

// Where it stands in the world is a matter of looks.
TEST(BakeSkies, ACachedFileTurnsItsSky) {
    const TemporaryFolder folder;
    const Scene scene = terrain_under_sky();
    ASSERT_TRUE(bake(scene, all_paged(), folder / "a.rpb").ok());
    const uint64_t fingerprint = *bake_fingerprint(scene, all_paged());
    Scene turned = scene;
    for (float& v : turned.lights[0].p) v = -v;
    ASSERT_EQ(*bake_fingerprint(turned, all_paged()), fingerprint);
    const auto opened = open_baked(folder / "a.rpb", turned, fingerprint);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    ASSERT_TRUE(opened->has_value());
    const BakedScene& reopened = (*opened)->source().scene();
    EXPECT_TRUE(reopened.light_images[0]->texels.empty());
    EXPECT_EQ(reopened.identity(), bake_in_memory(turned, all_paged()).identity());
    // A scene without such a sky is not what the file was baked from, whatever its fingerprint.
    for (const Scene& another : {scene_of({mesh_shape(terrain(20))}), under_sky(scene_of({mesh_shape(terrain(20))}), 100)}) {
        const auto refused = open_baked(folder / "a.rpb", another, fingerprint);
        ASSERT_TRUE(refused.ok()) << refused.status().message();
        EXPECT_FALSE(refused->has_value());
    }
}

}  // namespace
}  // namespace raypager
