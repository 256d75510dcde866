// The real Open Image Denoise, where the environment variable RAYPAGER_OIDN names one.
#include "raypager/denoise.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "procedural/make_scene.hpp"
#include "raypager/raypager.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

// In the relative error the lamp, a hundred times as bright as all else, counts no more than what it shines on.
double relative_mse(const Image& picture, const Image& reference) {
    const auto difference = compare_images(picture, reference);
    return difference ? difference->relative_mse : -1;
}

TEST(RealDenoiser, a_denoised_picture_is_nearer_to_one_of_many_samples) {
    const char* library = std::getenv("RAYPAGER_OIDN");
    if (!library || !*library) GTEST_SKIP() << "RAYPAGER_OIDN names no Open Image Denoise";
    const support::TemporaryFolder folder;
    MakeSceneOptions make;
    make.kind = "cornell";
    make.directory = folder.path();
    make.triangles = 20000;
    const auto made = make_scene(make);
    ASSERT_TRUE(made.ok()) << made.status().message();
    const auto scene = import_scene({made->scene_file}, {});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    const auto baked = bake(*scene, BakeOptions());
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    RenderOptions options;
    options.width = options.height = 64;
    options.spp = 2048;
    options.seed = 1;
    const auto reference = render(baked->blocks, options);
    ASSERT_TRUE(reference.ok()) << reference.status().message();
    options.spp = 16;
    options.seed = 0;
    options.layers.add(FilmLayer::albedo);
    options.layers.add(FilmLayer::normal);
    const auto noisy = render(baked->blocks, options);
    ASSERT_TRUE(noisy.ok()) << noisy.status().message();
    const Image &albedo = noisy->layers[0].image, &normal = noisy->layers[1].image;
    const double before = relative_mse(noisy->image, reference->image);
    for (const bool fast : {true, false}) {
        const auto clean = denoise(noisy->image, &albedo, &normal, {{}, fast});
        ASSERT_TRUE(clean.ok()) << clean.status().message();
        const double after = relative_mse(*clean, reference->image);
        std::cout << "relative MSE of 16 samples per pixel against 2048: " << before << ", denoised" << (fast ? " fast " : " ") << after << "\n";
        EXPECT_GE(after, 0);
        EXPECT_LT(after, before / 4);
    }
}

}  // namespace
}  // namespace raypager
