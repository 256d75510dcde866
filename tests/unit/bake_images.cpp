// Images of textures in block files: what is baked, what a cached file is still good for, and what stops a bake.
#include "bake/bake_images.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>

#include "bake/restyle.hpp"
#include "base/parallel.hpp"
#include "support/failing_file_system.hpp"
#include "support/textured_scene.hpp"
#include "texture/texture_words.hpp"
#include "texture/tiler.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;
using support::with_images;

using ImagePages = std::vector<std::vector<std::byte>>;

Scene textured_terrain(uint32_t n = 30) { return with_images(scene_of({mesh_shape(terrain(n))})); }

ImagePages pages_of(const BlockSource& source) {
    ImagePages pages(source.scene().pages.size(), std::vector<std::byte>(RP_TEXTURE_PAGE_BYTES));
    for (uint32_t i = 0; i < pages.size(); i++) EXPECT_TRUE(source.read_page(i, pages[i]).ok());
    return pages;
}

// Each image by itself.
ImagePages pages_expected(const Scene& scene, const std::vector<uint32_t>& used, const BakedScene& baked) {
    ImagePages pages(baked.pages.size(), std::vector<std::byte>(RP_TEXTURE_PAGE_BYTES));
    for (size_t i = 0; i < used.size(); i++) {
        const rp_image& image = baked.images[i];
        const auto put = [&](uint32_t page, uint32_t at, std::span<const std::byte> bytes) {
            std::ranges::copy(bytes, pages[page].begin() + at);
            return Status();
        };
        const auto page = [&](uint32_t number, std::span<const std::byte> bytes) { return put(number, 0, bytes); };
        EXPECT_TRUE(
            tile_image(*scene.images[used[i]], image, std::span(baked.image_levels).subspan(image.first_level, image.levels), {page, put}).ok());
    }
    return pages;
}

TEST(BakeImages, PagesHoldTheLevelsOfTheImagesThatAreUsed) {
    const TemporaryFolder folder;
    const Scene scene = textured_terrain();
    const auto file = bake_and_open(scene, folder / "a.rpb", 16 << 10);
    const BakedScene& baked = file->scene();
    ASSERT_EQ(baked.images.size(), 5u);
    EXPECT_GT(baked.pages.size(), 8u);
    EXPECT_EQ(baked.image_levels[0].width, 300u);
    EXPECT_EQ(baked.texture_ops.size(), scene.texture_ops.size());
    EXPECT_EQ(baked.texture_ops[3].image, 2u);  // the fourth of the scene: the third is not used
    EXPECT_EQ(baked.texture_maps.size(), 1u);
    EXPECT_EQ(baked.texel_words(), 1u + 1 + 1 + 2 + 2);
    EXPECT_EQ(pages_of(*file), pages_expected(scene, {0, 1, 3, 4, 5}, baked));
    EXPECT_EQ(baked.pageable_count(), baked.blocks.size() + baked.pages.size());
    EXPECT_EQ(baked.memory_bytes(BlockForm::wide), baked.geometry_bytes(BlockForm::wide) + baked.pages.size() * RP_TEXTURE_PAGE_BYTES);
    EXPECT_EQ(baked.largest_pageable(BlockForm::stored), RP_TEXTURE_PAGE_BYTES);
    EXPECT_EQ(baked.pageable_name(static_cast<uint32_t>(baked.blocks.size()) + 2), "page 2 of images");
}

TEST(BakeImages, AreTheSameHoweverManyAreBakedAtATime) {
    const TemporaryFolder folder;
    const Scene scene = textured_terrain();
    bake_and_open(scene, folder / "many.rpb", 16 << 10);
    const WorkersAtMost one(1);
    bake_and_open(scene, folder / "one.rpb", 16 << 10);
    EXPECT_EQ(support::read_file(folder / "many.rpb"), support::read_file(folder / "one.rpb"));
}

TEST(BakeImages, AreInMemoryWhatTheyAreInAFile) {
    const TemporaryFolder folder;
    const Scene scene = textured_terrain();
    BakeOptions options;
    options.block_bytes = 16 << 10;
    const auto baked = bake(scene, options);
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    const auto file = bake_and_open(scene, folder / "a.rpb", 16 << 10);
    EXPECT_EQ(baked->blocks.source().scene().identity(), file->scene().identity());
    EXPECT_EQ(pages_of(baked->blocks.source()), pages_of(*file));
    EXPECT_EQ(baked->summary.images, 5u);
    EXPECT_EQ(baked->summary.pages, file->scene().pages.size());
    EXPECT_EQ(baked->summary.texture_bytes, file->scene().texture_bytes());
}

TEST(BakeImages, WithoutGeometryAndOverTheDisk) {
    const TemporaryFolder folder;
    const auto empty = bake_and_open(with_images(scene_of({})), folder / "empty.rpb", 16 << 10);
    EXPECT_TRUE(empty->scene().blocks.empty());
    const Scene scene = textured_terrain(400);
    BakeOptions options;
    options.block_bytes = 16 << 10;
    options.host_limit = 16 << 20;
    const auto summary = bake(scene, options, folder / "spilled.rpb");
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_GT(summary->buckets, 0u);
    const auto file = BlockFile::open(folder / "spilled.rpb");
    ASSERT_TRUE(file.ok()) << file.status().message();
    EXPECT_EQ(pages_of(**file), pages_of(*empty));
}

TEST(BakeImages, IdentityIsThatOfThePicture) {
    const TemporaryFolder folder;
    const auto identity = [&](const Scene& scene) { return bake_and_open(scene, folder / "a.rpb", 16 << 10)->scene().identity(); };
    const uint64_t first = identity(textured_terrain());
    Scene other = textured_terrain();
    EXPECT_EQ(identity(other), first);
    other.images[4] = support::random_image(*other.images[4]->shape(), 99);
    EXPECT_NE(identity(other), first);
    other = textured_terrain();
    other.texture_ops[0].a[0] = 2;
    EXPECT_NE(identity(other), first);
    other = textured_terrain();
    other.texture_maps[0].m[0] = 2;
    EXPECT_NE(identity(other), first);
}

// Programs are looks: a file whose images are the same takes on others.
TEST(BakeImages, ACachedFileTakesOnOtherPrograms) {
    const TemporaryFolder folder;
    const BakeOptions options;
    const Scene scene = textured_terrain();
    const uint64_t fingerprint = *bake_fingerprint(scene, options);
    ASSERT_TRUE(bake(scene, options, folder / "a.rpb").ok());
    Scene other = scene;
    other.texture_ops[0].a[1] = 0.5f;
    other.texture_maps.push_back(other.texture_maps[0]);
    EXPECT_EQ(*bake_fingerprint(other, options), fingerprint);
    const auto opened = open_baked(folder / "a.rpb", other, fingerprint);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    ASSERT_TRUE(opened->has_value());
    ASSERT_TRUE(bake(other, options, folder / "b.rpb").ok());
    EXPECT_EQ((*opened)->source().scene().identity(), (*BlockFile::open(folder / "b.rpb"))->scene().identity());
    // Other images are another file.
    other = scene;
    other.images[2] = other.images[0];
    EXPECT_EQ(*bake_fingerprint(other, options), fingerprint);  // nobody reads it
    other.images[1] = support::random_image(*scene.images[1]->shape(), 77);
    EXPECT_NE(*bake_fingerprint(other, options), fingerprint);
    other = scene;
    other.texture_ops.erase(other.texture_ops.begin(), other.texture_ops.begin() + 2);
    EXPECT_NE(*bake_fingerprint(other, options), fingerprint);
}

TEST(BakeImages, TexelsThatWouldOverlapAreRefused) {
    const TemporaryFolder folder;
    const BakeOptions options;
    const Scene scene = textured_terrain();
    ASSERT_TRUE(bake(scene, options, folder / "a.rpb").ok());
    Scene other = scene;
    other.texture_ops[7].lookup--;  // of the last image, on the second word of the one before it
    ASSERT_TRUE(validate(other).ok());
    const auto failed = bake(other, options, folder / "b.rpb");
    ASSERT_FALSE(failed.ok());
    EXPECT_NE(failed.status().message().find("two texels in one place"), std::string::npos) << failed.status().message();
    EXPECT_FALSE(open_baked(folder / "a.rpb", other, *bake_fingerprint(scene, options)).ok());
}

TEST(BakeImages, WhatCannotBeReadEndsTheBake) {
    const TemporaryFolder folder;
    Scene scene = textured_terrain();
    scene.images[2] = image_file_source(folder / "unused.png");
    EXPECT_TRUE(bake(scene, {}, folder / "a.rpb").ok());
    scene.images[3] = image_file_source(folder / "missing.png");
    const auto missing = bake(scene, {}, folder / "b.rpb");
    ASSERT_FALSE(missing.ok());
    EXPECT_NE(missing.status().message().find("missing.png"), std::string::npos);
    // A file that says one thing before, and another when it is read.
    class Changing final : public ImageSource {
    public:
        std::string name() const override { return "changing.png"; }
        Result<ImageShape> shape() const override { return ImageShape{400, 130, 1, TexelKind::unsigned_16, false}; }
        Status read(const std::function<Status(std::span<const std::byte>)>& take) const override { return take(std::vector<std::byte>(800 * 129)); }
        Result<uint64_t> fingerprint() const override { return uint64_t{1}; }
    };
    scene.images[3] = std::make_shared<Changing>();
    const auto changed = bake(scene, {}, folder / "b.rpb");
    ASSERT_FALSE(changed.ok());
    EXPECT_EQ(changed.status().message(), "changing.png: ended after 129 of 130 rows; it changed while it was read");
    EXPECT_EQ(folder.files().size(), 1u);
}

TEST(BakeImages, LimitsAndStopsHold) {
    const TemporaryFolder folder;
    Scene scene = textured_terrain();
    BakeOptions options;
    options.host_limit = 16 << 20;
    class Wide final : public ImageSource {
    public:
        std::string name() const override { return "wide.png"; }
        Result<ImageShape> shape() const override { return ImageShape{RP_IMAGE_MAX_SIZE, 1, 4, TexelKind::half, false}; }
        Status read(const std::function<Status(std::span<const std::byte>)>&) const override { return Status::failed("not to be read"); }
        Result<uint64_t> fingerprint() const override { return uint64_t{1}; }
    };
    scene.images[4] = std::make_shared<Wide>();
    const auto wide = bake(scene, options, folder / "a.rpb");
    ASSERT_FALSE(wide.ok());
    EXPECT_NE(wide.status().message().find("wide.png: an image of 1048576 x 1 texels takes"), std::string::npos) << wide.status().message();
    EXPECT_NE(wide.status().message().find("--host-limit"), std::string::npos);
    std::atomic<bool> stop = false;
    options.stop = &stop;
    std::atomic<double> fraction = -1;
    options.progress = [&](const char* stage, double done) {
        if (std::string_view(stage) != "images") return;
        fraction = done;
        stop = true;
    };
    const auto stopped = bake(textured_terrain(), options, folder / "a.rpb");
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.status().kind(), ErrorKind::interrupted);
    EXPECT_GE(fraction, 0);
    EXPECT_TRUE(folder.files().empty());
    options.stop = nullptr;
    ASSERT_TRUE(bake(textured_terrain(), options, folder / "a.rpb").ok());
    EXPECT_EQ(fraction, 1);
}

TEST(BakeImages, AFullDiskLeavesNothing) {
    const TemporaryFolder folder;
    const Scene scene = with_images(scene_of({}));
    support::FailingFileSystem disk;
    int64_t writes = 1;
    for (;; writes++) {
        ASSERT_LT(writes, 1000);
        disk.error_number = ENOSPC;
        disk.fail_write_in = writes;
        const auto baked = bake(scene, {}, folder / "a.rpb");
        disk.clear();
        if (baked.ok()) break;
        EXPECT_NE(baked.status().message().find("a.rpb: cannot be written"), std::string::npos) << baked.status().message();
        EXPECT_TRUE(folder.files().empty());
    }
    EXPECT_GT(writes, 10);  // of pages, and what is before and behind them
}

// What kernels get: the parts begin where they should, and at multiples of 16 bytes.
TEST(BakeImages, TextureWordsAreTheTables) {
    const TemporaryFolder folder;
    const BakedScene baked = bake_and_open(textured_terrain(), folder / "a.rpb", 16 << 10)->scene();
    const TextureWords words = texture_words(baked);
    EXPECT_EQ(words.words.size() * sizeof(uint32_t), texture_words_bytes(baked));
    EXPECT_EQ(std::bit_cast<float>(words.words[255]), 1.0f);
    EXPECT_EQ(words.images_at, 256u);
    for (const uint32_t at : {words.images_at, words.levels_at, words.ops_at, words.maps_at}) EXPECT_EQ(at % 4, 0u);
    const auto same = [&](uint32_t at, const auto& items) {
        return std::memcmp(words.words.data() + at, items.data(), items.size() * sizeof(items[0])) == 0;
    };
    EXPECT_TRUE(same(words.images_at, baked.images) && same(words.levels_at, baked.image_levels));
    EXPECT_TRUE(same(words.ops_at, baked.texture_ops) && same(words.maps_at, baked.texture_maps));
    EXPECT_EQ(texture_words_bytes(BakedScene()), 0u);
}

}  // namespace
}  // namespace raypager
