// make_scene museum: as many images of as many bytes as asked for, each of them used, in a scene that loads without a warning.
#include <gtest/gtest.h>

#include <bit>
#include <set>

#include "base/hash.hpp"
#include "procedural/image_painter.hpp"
#include "procedural/make_scene.hpp"
#include "procedural/museum_parts.hpp"
#include "procedural/museum_plan.hpp"
#include "procedural/paintings.hpp"
#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/procedural_meshes.hpp"

namespace raypager {
namespace {

using namespace procedural_test;

MakeSceneOptions museum(const std::filesystem::path& folder, uint64_t textures, uint64_t bytes) {
    MakeSceneOptions options;
    options.kind = "museum";
    options.directory = folder;
    options.textures = textures;
    options.texture_bytes = bytes;
    return options;
}

TEST(ProceduralMuseum, LoadsWithoutWarningsAndUsesEveryImage) {
    for (const uint64_t textures : {16u, 45u, 130u}) {
        const support::TemporaryFolder folder;
        const auto made = make_scene(museum(folder.path(), textures, textures * 40'000));
        ASSERT_TRUE(made.ok()) << made.status().message();
        EXPECT_EQ(made->textures, textures);
        EXPECT_NEAR(static_cast<double>(made->texture_bytes), static_cast<double>(textures * 40'000), 0.1 * static_cast<double>(textures * 40'000));
        uint64_t files = 0;
        for (const auto& file : folder.files()) files += file.extension() == ".ppm" || file.extension() == ".pgm" ? 1 : 0;
        EXPECT_EQ(files, textures);

        const auto scene = import_scene({made->scene_file});
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        EXPECT_TRUE(scene->warnings.empty()) << scene->warnings.front();
        ASSERT_EQ(scene->images.size(), textures) << "the scene has those images that a material of a shape reads";
        uint64_t bytes = 0;
        std::set<std::pair<uint32_t, uint32_t>> sizes;
        for (const auto& image : scene->images) {
            const auto shape = image->shape();
            ASSERT_TRUE(shape.ok());
            bytes += uint64_t{shape->width} * shape->height * shape->channels;
            for (const uint32_t side : {shape->width, shape->height}) ASSERT_TRUE(side >= 64 && side <= 16384) << side;
            sizes.insert({shape->width, shape->height});
        }
        EXPECT_EQ(bytes, made->texture_bytes);
        EXPECT_GT(sizes.size(), textures / 4) << "of many sizes";
    }
}

TEST(ProceduralMuseum, AskedBytesAreReachedAtEverySize) {
    for (const uint64_t textures : {16u, 300u, 5000u})
        for (const uint64_t each : {17'000u, 100'000u, 5'000'000u, 100'000'000u}) {
            MuseumPlan plan = plan_museum(textures, 3);
            ASSERT_EQ(plan.images.size(), textures);
            ASSERT_TRUE(size_images(plan.images, textures * each).ok());
            double bytes = 0;
            size_t powers = 0;
            for (const MuseumImage& image : plan.images) {
                bytes += static_cast<double>(image.bytes());
                powers += std::has_single_bit(image.width) && std::has_single_bit(image.height) ? 1 : 0;
            }
            EXPECT_NEAR(bytes, static_cast<double>(textures * each), 0.02 * static_cast<double>(textures * each)) << textures << " of " << each;
            EXPECT_GT(powers, textures / 5);
            EXPECT_LT(powers, textures - textures / 5);
        }
}

TEST(ProceduralMuseum, SizesThatCannotBeAreRefused) {
    MuseumPlan plan = plan_museum(20, 1);
    EXPECT_EQ(size_images(plan.images, 20 * 1000).exit_code(), 2);
    EXPECT_EQ(size_images(plan.images, uint64_t{1} << 40).exit_code(), 2);
    const support::TemporaryFolder folder;
    EXPECT_EQ(make_scene(museum(folder / "a", 15, 0)).status().exit_code(), 2);
    EXPECT_EQ(make_scene(museum(folder / "b", 20'001, 0)).status().exit_code(), 2);
    EXPECT_EQ(make_scene(museum(folder / "c", 20, 1000)).status().exit_code(), 2);
    MakeSceneOptions options = museum(folder / "d", 300, 0);
    options.triangles = 1000;
    EXPECT_NE(make_scene(options).status().message().find("at least"), std::string::npos) << "each frame has some";
    options = museum(folder / "e", 300, 0);
    options.kind = "clutter";
    EXPECT_EQ(make_scene(options).status().exit_code(), 2);
    EXPECT_TRUE(folder.files().empty()) << "nothing is written before";
}

TEST(ProceduralMuseum, EverythingHangsApartAndInside) {
    const MuseumPlan plan = plan_museum(2000, 5);
    std::set<uint32_t> used;
    for (const MuseumPainting& p : plan.paintings) {
        for (const uint32_t image : {p.picture, p.roughness, p.frame_roughness})
            EXPECT_TRUE(image == no_image || used.insert(image).second) << "an image of its own";
        EXPECT_GT(p.width, 0.4);
        EXPECT_GT(p.height, 0.4);
        const Vector end = p.corner.at(p.width, p.height, 0);
        for (const Vector& at : {p.corner.origin, end}) {
            EXPECT_LE(std::abs(at[0]), plan.half_width() + 1e-9);
            EXPECT_TRUE(at[1] > 0.5 && at[1] < plan.height()) << at[1];
            EXPECT_TRUE(at[2] <= 0 && at[2] >= -plan.length() - 1e-9) << at[2];
        }
        EXPECT_NEAR(length(cross(p.corner.x, p.corner.y) - p.corner.z), 0, 1e-12) << "seen from inside, not mirrored";
    }
    for (size_t i = 0; i < plan.paintings.size(); i++)
        for (size_t k = 0; k < i; k++) {
            const MuseumPainting &a = plan.paintings[i], &b = plan.paintings[k];
            if (a.corner.z != b.corner.z) continue;
            const Vector off = b.corner.origin - a.corner.origin;
            const double x = dot(off, a.corner.x), y = dot(off, a.corner.y);
            EXPECT_TRUE(x >= a.width || -x >= b.width || y >= a.height || -y >= b.height) << i << " over " << k;
        }
    EXPECT_LE(plan.statues.size(), plan.sites());
}

TEST(ProceduralMuseum, ImagesCanBeLaidSideBySide) {
    RowNoise noise({64, 48, 7, 5, 3}, 9);
    const std::vector<float> first(noise.row(0).begin(), noise.row(0).end());
    const std::vector<float> last(noise.row(47).begin(), noise.row(47).end());
    float beside = 0, below = 0;
    for (size_t x = 0; x < 64; x++) below = std::max(below, std::abs(first[x] - last[x]));
    for (uint32_t y = 0; y < 48; y++) {
        const auto row = noise.row(y);
        beside = std::max(beside, std::abs(row[0] - row[63]));
        for (const float n : row) ASSERT_LE(std::abs(n), 1.0f);
    }
    EXPECT_LT(beside, 0.5f);
    EXPECT_LT(below, 0.5f);
    // Out of order, rows are the same.
    const auto again = noise.row(0);
    EXPECT_TRUE(std::equal(again.begin(), again.end(), first.begin()));
}

// Of all kinds: compilers that draw the random numbers of an expression in another order would make others.
TEST(ProceduralMuseum, PaintingsAreTheSameOnEveryMachine) {
    uint64_t hash = 0;
    for (uint64_t seed = 1; seed <= 64; seed++) {
        const auto painting = make_painting(64, 48, 1.05, seed);
        std::vector<uint8_t> row(size_t{64} * painting->channels());
        for (uint32_t y = 0; y < 48; y++) {
            painting->row(y, row);
            hash = hash64(std::as_bytes(std::span(row)), hash);
        }
    }
    EXPECT_EQ(hex64(hash), "fa66e3318c99d391");
}

TEST(ProceduralMuseum, SurfacesFaceOutwards) {
    TriangleMesh block, statue;
    add_block(block, {}, 1, 2, 3);
    add_panel(block, {-0.5, 0, -1.5}, {1, 0, 0}, {0, 0, 3});  // its lower side, which blocks lack
    EXPECT_NEAR(signed_volume(block), 6, 1e-6);
    for (const uint64_t seed : {1u, 2u, 3u, 4u}) {
        statue = {};
        const UvGrid grid = statue_grid({0, 0.5, 0}, 1.2, 4000, seed);
        add_grid(statue, grid);
        EXPECT_EQ(statue.triangles.size(), grid.triangles());
        EXPECT_NEAR(static_cast<double>(grid.triangles()), 4000, 200);
        EXPECT_GT(signed_volume(statue), 0);
        EXPECT_EQ(statue.uvs.size(), statue.positions.size());
    }
}

}  // namespace
}  // namespace raypager
