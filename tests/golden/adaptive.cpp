// Adaptive sampling: the same picture to the bit whatever the limits are and wherever it was stopped, unbiased within noise, and worth its while.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "raypager/materials.hpp"
#include "raypager/raypager.hpp"
#include "reference/scenes.hpp"
#include "support/device_scene.hpp"
#include "support/floor_shape.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_options.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

// What a glass ball makes of the light of a small lamp, on a floor.
Scene caustic() {
    Scene scene;
    scene.materials = {diffuse_material({0.6f, 0.6f, 0.6f}), dielectric_material(1.5f), absorbing_material()};
    scene.shapes.push_back(support::floor_shape());
    Shape ball;
    ball.name = "ball";
    ball.material = 1;
    ball.sphere = {{0, 0, 1}, 1};
    scene.shapes.push_back(ball);
    Shape lamp;
    lamp.name = "lamp";
    lamp.material = 2;
    lamp.sphere = {{1.5f, 1, 5}, 0.25f};
    lamp.area_light = 0;
    scene.area_lights = {{{60, 60, 60}}};
    scene.shapes.push_back(lamp);
    scene.camera.eye = {0, -6, 4};
    scene.camera.forward = {0, 0.86f, -0.51f};
    scene.camera.right = {0.42f, 0, 0};
    scene.camera.up = {0, 0.16f, 0.27f};
    scene.width = 48, scene.height = 36;
    return scene;
}

class Adaptive : public testing::Test {
protected:
    void bake_scene(const Scene& scene) {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        auto file = support::bake_and_open(scene, options, folder_.path(), "scene");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
    }
    Result<MeasuredRender> run(const support::TestOptions& options) const { return render(*file_, options, {}); }

    support::TemporaryFolder folder_;
    std::shared_ptr<const BlockFile> file_;
    support::TestOptions base_;
};

TEST_F(Adaptive, pictures_are_the_same_for_every_limit) {
    bake_scene(reference::cornell_small({.subdivisions = 4, .wall_divisions = 16}, {32, 32}));
    base_.spp = 50;
    base_.adaptive_error = 0.5;
    base_.tuning.paths = 3000;
    base_.layers.add(FilmLayer::samples);
    base_.layers.add(FilmLayer::albedo);
    const auto first = run(base_);
    ASSERT_TRUE(first.ok()) << first.status().message();
    EXPECT_TRUE(first->report.complete);
    EXPECT_GT(first->report.average_spp, 16);
    EXPECT_LT(first->report.average_spp, 45);
    float fewest = 1000, most = 0;
    for (const float samples : first->layers[1].image.values) {
        fewest = std::min(fewest, samples);
        most = std::max(most, samples);
    }
    EXPECT_EQ(fewest, 16);
    EXPECT_EQ(most, 50);
    support::Turns turns(0, 5);
    for (const Traversal traversal : support::traversals()) {
        for (const PolicyName& policy : policy_names) {
            for (const double percent : {100.0, 20.0, 0.001}) {
                if (policy.kind != PolicyKind::most_wanted && percent != 20) continue;
                if (!turns.take()) continue;
                support::TestOptions options = base_;
                options.tuning.traversal = traversal;
                options.tuning.policy = policy.kind;
                options.geometry_limit_percent = percent;
                options.tuning.paths = percent == 20 ? 300 : 3000;
                options.tuning.region = percent == 20 ? 50 : 0;
                const auto other = run(options);
                ASSERT_TRUE(other.ok()) << other.status().message();
                EXPECT_EQ(other->report.film_hash, first->report.film_hash) << policy.name << " at " << percent << " %";
                EXPECT_EQ(other->report.layers_hash, first->report.layers_hash);
                EXPECT_LE(other->report.peak.memory_bytes, other->report.limits.memory_bytes);
            }
        }
    }
}

TEST_F(Adaptive, pictures_are_the_same_after_stops_in_every_stage) {
    bake_scene(reference::cornell_small({.subdivisions = 4, .wall_divisions = 16}, {24, 24}));
    base_.spp = 64;
    base_.adaptive_error = 0.3;
    base_.geometry_limit_percent = 50;
    base_.tuning.paths = 500;
    const auto whole = run(base_);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    const auto blocks = Blocks::open(file_->path());
    ASSERT_TRUE(blocks.ok()) << blocks.status().message();
    RenderOptions options = base_;
    options.checkpoint.file = folder_.path() / "a.ckpt";
    uint32_t runs = 0;
    for (bool done = false; !done; runs++) {
        auto session = Session::create(*blocks, options);
        ASSERT_TRUE(session.ok()) << session.status().message();
        // Of different lengths, so that it stops everywhere, but long enough for paths to end.
        for (uint32_t round = 0; round < 40 + 7 * (runs % 5) && !session->done(); round++) ASSERT_TRUE(session->step(0).ok());
        done = session->done();
        if (!done) {
            ASSERT_TRUE(session->checkpoint().ok());
        }
        options.checkpoint.resume = true;
        options.tuning.paths = 200 + 100 * (runs % 5);
        if (!done) continue;
        const auto result = session->finish();
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_TRUE(result->report.complete);
        EXPECT_EQ(result->report.film_hash, whole->report.film_hash);
    }
    EXPECT_GT(runs, 3u);
    // A checkpoint of the finished picture is finished.
    const auto again = render(*blocks, options);
    ASSERT_TRUE(again.ok()) << again.status().message();
    EXPECT_EQ(again->report.film_hash, whole->report.film_hash);
    options.adaptive_error = 0.2;
    const auto refused = Session::create(*blocks, options);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.status().message().find("its --adaptive is 0.3, not 0.2"), std::string::npos) << refused.status().message();
}

// A stop without a checkpoint, and one by the clock, leave an even picture.
TEST_F(Adaptive, renders_end_when_they_are_told_to) {
    bake_scene(reference::cornell_small({.subdivisions = 2, .wall_divisions = 8}, {48, 48}));
    base_.spp = 60000;
    base_.adaptive_error = 0.0001;
    base_.time_seconds = 0.5;
    const auto timed = run(base_);
    ASSERT_TRUE(timed.ok()) << timed.status().message();
    EXPECT_GE(timed->report.average_spp, 1);
    EXPECT_LT(timed->report.average_spp, 60000);
    base_.time_seconds = 0;
    const std::atomic<bool> stop{true};
    base_.stop = &stop;
    const auto stopped = run(base_);
    ASSERT_TRUE(stopped.ok()) << stopped.status().message();
    EXPECT_FALSE(stopped->report.complete);
}

// Against the mean of many more samples per pixel: what is left of the error, for as many samples as a picture has that gives all pixels the same.
TEST_F(Adaptive, sampling_leaves_less_error_and_no_bias) {
    struct Case {
        const char* name;
        Scene scene;
    };
    const Case cases[] = {{"cornell", reference::cornell_small({.subdivisions = 2, .wall_divisions = 8}, {40, 40})},
                          {"terrain", reference::terrain_small(48, true, {48, 36})},
                          {"caustic", caustic()}};
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        bake_scene(c.scene);
        support::TestOptions options;
        options.spp = 1024;
        options.seed = 5;
        const auto reference = run(options);
        options.seed = 0;
        options.spp = 256;
        options.adaptive_error = 0.3;
        const auto adaptive = run(options);
        ASSERT_TRUE(reference.ok() && adaptive.ok()) << adaptive.status().message();
        options.adaptive_error = 0;
        options.spp = static_cast<uint32_t>(std::lround(adaptive->report.average_spp));
        const auto even = run(options);
        ASSERT_TRUE(even.ok()) << even.status().message();
        const double with = compare_images(adaptive->image, reference->image)->rmse, without = compare_images(even->image, reference->image)->rmse;
        double difference = 0, sum = 0, squares = 0;
        for (size_t i = 0; i < reference->image.values.size(); i++) {
            const double d = adaptive->image.values[i] - reference->image.values[i];
            difference += d;
            squares += d * d;
            sum += reference->image.values[i];
        }
        // Channels carry the same noise.
        const double bias = difference / sum, noise = std::sqrt(3 * squares) / sum;
        std::printf("%s: %.1f samples per pixel, RMSE %.5f, with the same number everywhere %.5f; the mean is off by %.5f, its noise %.5f\n", c.name,
                    adaptive->report.average_spp, with, without, bias, noise);
        EXPECT_LT(std::abs(bias), 4 * noise);
        // Larger pictures gain more (bench/journal/adaptive.md).
        EXPECT_LT(with, 0.92 * without);
    }
}

}  // namespace
}  // namespace raypager
