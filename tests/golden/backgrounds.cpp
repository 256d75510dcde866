// What the camera sees where nothing is: the sky, another colour, or nothing, which alpha tells. All else is lit as ever.
#include <gtest/gtest.h>

#include <cmath>

#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/interrupted_render.hpp"

namespace raypager {
namespace {

// A square that covers the left half of the picture, under a sky of (1, 2, 3).
Scene half_covered() {
    Scene scene;
    scene.width = 32;
    scene.height = 16;
    scene.spp = 16;
    scene.camera = *make_camera({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40, scene.width, scene.height);
    scene.materials.resize(1);
    std::fill_n(scene.materials[0].color, 3, 0.5f);
    scene.lights.resize(1);
    scene.lights[0].kind = RP_LIGHT_INFINITE;
    for (size_t i = 0; i < 3; i++) scene.lights[0].radiance[i] = static_cast<float>(i + 1);
    TriangleMesh mesh;
    mesh.positions = {{-100, -100, 0}, {0, -100, 0}, {0, 100, 0}, {-100, 100, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    Shape shape;
    shape.name = "square";
    shape.mesh = std::make_shared<MeshInMemory>("square", mesh);
    scene.shapes.push_back(shape);
    return scene;
}

class Backgrounds : public testing::Test {
protected:
    void SetUp() override {
        auto file = support::bake_and_open(half_covered(), {}, folder_.path(), "scene");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
    }
    MeasuredRender run(const RenderOptions& options) const {
        auto result = render(*file_, options, {});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result ? std::move(*result) : MeasuredRender();
    }
    static std::vector<float> pixel(const Image& image, uint32_t x, uint32_t y) {
        const auto at = image.values.begin() + static_cast<ptrdiff_t>((size_t{y} * image.width + x) * image.channels);
        return {at, at + image.channels};
    }

    support::TemporaryFolder folder_;
    std::shared_ptr<const BlockFile> file_;
};

TEST_F(Backgrounds, ReplaceTheSkyForTheCameraAlone) {
    for (const Traversal traversal : support::traversals()) {
        RenderOptions options;
        options.tuning.traversal = traversal;
        const MeasuredRender sky = run(options);
        EXPECT_EQ(pixel(sky.image, 24, 8), (std::vector<float>{1, 2, 3}));
        options.background = Background{false, {0.25f, 0, 8}};
        const MeasuredRender color = run(options);
        ASSERT_EQ(color.image.channels, 3u);
        EXPECT_EQ(pixel(color.image, 24, 8), (std::vector<float>{0.25f, 0, 8}));
        EXPECT_NE(color.report.film_hash, sky.report.film_hash);
        options.background = Background{true, {}};
        const MeasuredRender clear = run(options);
        ASSERT_EQ(clear.image.channels, 4u);
        EXPECT_EQ(pixel(clear.image, 24, 8), (std::vector<float>{0, 0, 0, 0}));
        EXPECT_EQ(clear.report.average_spp, 16);
        for (uint32_t y = 0; y < 16; y++)
            for (uint32_t x = 0; x < 15; x++) {
                const auto of_sky = pixel(sky.image, x, y);
                EXPECT_EQ(pixel(color.image, x, y), of_sky) << x << " " << y;
                EXPECT_GT(of_sky[0], 0) << "the sky lights it still";
                EXPECT_EQ(pixel(clear.image, x, y), (std::vector<float>{of_sky[0], of_sky[1], of_sky[2], 1}));
            }
    }
}

// Colours are multiplied by alpha already: over the sky, the picture is that with the sky.
TEST_F(Backgrounds, AlphaIsTheShareOfSamplesThatMetSomething) {
    RenderOptions options;
    options.camera = make_camera({0.03f, 0, 5}, {0.03f, 0, 0}, {0, 1, 0}, 40, 32, 16);  // the edge goes through pixels
    const MeasuredRender sky = run(options);
    options.background = Background{true, {}};
    const MeasuredRender clear = run(options);
    bool edge = false;
    for (uint32_t y = 0; y < 16; y++)
        for (uint32_t x = 0; x < 32; x++) {
            const auto a = pixel(clear.image, x, y), b = pixel(sky.image, x, y);
            edge = edge || (a[3] > 0 && a[3] < 1);
            EXPECT_FLOAT_EQ(a[3] * 16, std::round(a[3] * 16)) << "of 16 samples";
            for (size_t channel = 0; channel < 3; channel++) EXPECT_NEAR(a[channel] + (1 - a[3]) * float(channel + 1), b[channel], 1e-5);
        }
    EXPECT_TRUE(edge);
}

TEST_F(Backgrounds, GoOnFromCheckpointsOfTheSameBackground) {
    RenderOptions options;
    options.spp = 64;
    options.tuning.paths = 2000;
    options.background = Background{true, {}};
    const MeasuredRender whole = run(options);
    options.checkpoint.file = folder_ / "c.ckpt";
    const auto stopped = support::render_rounds(*file_, options, 5);
    ASSERT_TRUE(stopped.ok()) << stopped.status().message();
    ASSERT_FALSE(stopped->report.complete);
    options.checkpoint.resume = true;
    for (const auto& other : {std::optional<Background>(), std::optional(Background{false, {0, 0, 0}})}) {
        RenderOptions changed = options;
        changed.background = other;
        const auto refused = render(*file_, changed, {});
        ASSERT_FALSE(refused.ok());
        EXPECT_NE(refused.status().message().find("--background"), std::string::npos) << refused.status().message();
    }
    const MeasuredRender resumed = run(options);
    EXPECT_EQ(resumed.report.film_hash, whole.report.film_hash);
    EXPECT_EQ(resumed.image.values, whole.image.values);
}

}  // namespace
}  // namespace raypager
