// Layers of the film: the same to the bit whatever the limits are, and right where plain geometry says what they must be.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "raypager/materials.hpp"
#include "raypager/raypager.hpp"
#include "reference/instanced_scenes.hpp"
#include "reference/scenes.hpp"
#include "reference/textured_scenes.hpp"
#include "support/device_scene.hpp"
#include "support/floor_shape.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_options.hpp"

namespace raypager {
namespace {

const FilmLayers all_layers{~0u};

struct LayerCase {
    const char* name;
    Scene (*make)();
    bool nested = false;
};

const LayerCase layer_cases[] = {
    {"clutter",
     [] {
         return reference::clutter_small(60, 3, {32, 24});
     }},  // all materials and several lights
    {"instances",
     [] {
         return reference::strewn(120, {32, 24}, false);
     }},
    {"cutouts",
     [] {
         return reference::overridden_hedge(100, {32, 24});
     }},  // textures that are waited for, cut-outs, traits of instances
    {"groves",
     [] {
         return reference::groves(9, {32, 24});
     },
     true},  // instances in each other
};

void PrintTo(const LayerCase& c, std::ostream* out) { *out << c.name; }

class FilmLayersOf : public testing::TestWithParam<LayerCase> {
protected:
    void SetUp() override {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        if (GetParam().nested) options.flatten_limit = 0;
        auto file = support::bake_and_open(GetParam().make(), options, folder_.path(), "scene");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
        base_.spp = 4;
        base_.tuning.paths = 2000;
    }

    Result<MeasuredRender> run(const support::TestOptions& options) const { return render(*file_, options, {}); }

    support::TemporaryFolder folder_;
    std::shared_ptr<const BlockFile> file_;
    support::TestOptions base_;
};

TEST_P(FilmLayersOf, are_the_same_for_every_limit_and_change_no_picture) {
    const auto plain = run(base_);
    ASSERT_TRUE(plain.ok()) << plain.status().message();
    EXPECT_EQ(plain->report.layers_hash, 0u);
    base_.layers = all_layers;
    const auto first = run(base_);
    ASSERT_TRUE(first.ok()) << first.status().message();
    EXPECT_EQ(first->report.film_hash, plain->report.film_hash);
    EXPECT_GT(first->report.peak.memory_bytes, plain->report.peak.memory_bytes);
    ASSERT_EQ(first->layers.size(), film_layer_count);
    const bool nested = file_->scene().instance_levels() > 1;
    for (const Traversal traversal : nested ? std::vector{Traversal::ray} : support::traversals())
        for (const double percent : {100.0, 20.0, 0.001}) {  // the last: room for the largest block
            support::TestOptions options = base_;
            options.tuning.traversal = traversal;
            options.geometry_limit_percent = percent;
            options.tuning.paths = percent == 20 ? 200 : 2000;
            options.tuning.region = percent == 20 ? 50 : 0;
            const auto other = run(options);
            ASSERT_TRUE(other.ok()) << other.status().message();
            EXPECT_EQ(other->report.film_hash, plain->report.film_hash) << percent << " %";
            EXPECT_EQ(other->report.layers_hash, first->report.layers_hash) << percent << " %";
            EXPECT_LE(other->report.peak.memory_bytes, other->report.limits.memory_bytes);
        }
}

// What is traced again after a checkpoint must not count twice.
TEST_P(FilmLayersOf, are_those_of_a_render_without_stops_after_a_checkpoint) {
    base_.layers = all_layers;
    base_.geometry_limit_percent = 20;
    base_.tuning.paths = 500;
    const auto whole = run(base_);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    const auto blocks = Blocks::open(file_->path());
    ASSERT_TRUE(blocks.ok()) << blocks.status().message();
    RenderOptions options = base_;
    options.checkpoint.file = folder_.path() / "a.ckpt";
    for (int i = 0; i < 3; i++) {
        auto session = Session::create(*blocks, options);
        ASSERT_TRUE(session.ok()) << session.status().message();
        for (int round = 0; round < 7; round++) ASSERT_TRUE(session->step(0).ok());
        ASSERT_TRUE(session->checkpoint().ok());
        options.checkpoint.resume = true;
    }
    const auto resumed = render(*blocks, options);
    ASSERT_TRUE(resumed.ok()) << resumed.status().message();
    EXPECT_EQ(resumed->report.film_hash, whole->report.film_hash);
    EXPECT_EQ(resumed->report.layers_hash, whole->report.layers_hash);
    options.layers = {};
    const auto refused = Session::create(*blocks, options);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.status().message().find("its --layers are albedo,"), std::string::npos) << refused.status().message();
}

INSTANTIATE_TEST_SUITE_P(scenes, FilmLayersOf, testing::ValuesIn(layer_cases), [](const auto& param) { return std::string(param.param.name); });

// A floor at height 0, and balls of radius 1 on it at x = -3 and 3, instances of one object; seen from above.
Scene balls_from_above() {
    Scene scene;
    scene.materials = {diffuse_material({0.2f, 0.5f, 0.8f}), conductor_of_reflectance({0.9f, 0.6f, 0.3f}, 0.2f)};
    scene.shapes.push_back(support::floor_shape());
    Object ball;
    ball.name = "ball";
    Shape sphere;
    sphere.name = "sphere";
    sphere.material = 1;
    ball.shapes = {sphere};
    scene.objects = {ball};
    std::vector<Placement> placements(2);
    for (size_t i = 0; i < 2; i++) {
        placements[i].to_world[0][3] = i == 0 ? -3 : 3;
        placements[i].to_world[2][3] = 1;
    }
    scene.instances = {std::make_shared<InstancesInMemory>("balls", placements)};
    scene.lights = {infinite_light({1, 1, 1})};
    scene.camera.eye = {0, 0, 8};
    scene.camera.right = {0.8f, 0, 0};
    scene.camera.up = {0, 0.6f, 0};
    scene.camera.forward = {0, 0, -1};
    scene.width = 64, scene.height = 48;
    return scene;
}

TEST(FilmLayerValues, are_what_geometry_says) {
    const auto baked = bake(balls_from_above(), {});
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    RenderOptions options;
    options.spp = 16;
    options.layers = all_layers;
    const auto result = render(baked->blocks, options);
    ASSERT_TRUE(result.ok()) << result.status().message();
    const auto value = [&](FilmLayer layer, size_t pixel, size_t channel = 0) {
        const Image& image = result->layers[static_cast<size_t>(layer)].image;
        return image.values[pixel * image.channels + channel];
    };
    size_t on_floor = 0, on_ball[2] = {0, 0};
    for (size_t pixel = 0; pixel < 64 * 48; pixel++) {
        const float material = value(FilmLayer::material, pixel), instance = value(FilmLayer::instance, pixel);
        const Float3 p{value(FilmLayer::position, pixel, 0), value(FilmLayer::position, pixel, 1), value(FilmLayer::position, pixel, 2)};
        EXPECT_NEAR(value(FilmLayer::depth, pixel), 8 - p.z, 1e-4);
        EXPECT_EQ(value(FilmLayer::samples, pixel), 16);
        const Float3 n{value(FilmLayer::normal, pixel, 0), value(FilmLayer::normal, pixel, 1), value(FilmLayer::normal, pixel, 2)};
        if (material == 1) {
            on_floor++;
            EXPECT_EQ(instance, 0);
            EXPECT_EQ(value(FilmLayer::object, pixel), 0);
            EXPECT_NEAR(p.z, 0, 1e-5);
            // Where the pixel shows nothing else.
            if (std::abs(std::hypot(std::abs(p.x) - 3, p.y) - 1) > 1.2) {
                EXPECT_NEAR(n.z, 1, 1e-4);
                EXPECT_NEAR(value(FilmLayer::albedo, pixel, 1), 0.5, 2e-3);
                EXPECT_NEAR(value(FilmLayer::albedo, pixel, 2), 0.8, 2e-3);
            }
        } else {
            ASSERT_EQ(material, 2);
            ASSERT_TRUE(instance == 1 || instance == 2);
            EXPECT_EQ(value(FilmLayer::object, pixel), 1);
            on_ball[static_cast<size_t>(instance) - 1]++;
            const float x = p.x - (instance == 1 ? -3.0f : 3.0f);
            EXPECT_NEAR(std::hypot(x, p.y, p.z - 1), 1, 1e-4);
            if (std::hypot(x, p.y) < 0.5) {
                EXPECT_NEAR(n.x, x, 0.2);
                EXPECT_NEAR(n.y, p.y, 0.2);
                EXPECT_NEAR(value(FilmLayer::albedo, pixel, 0), 0.9, 5e-3);
                EXPECT_NEAR(value(FilmLayer::albedo, pixel, 2), 0.3, 5e-3);
            }
        }
    }
    EXPECT_GT(on_floor, 1000u);
    EXPECT_GT(on_ball[0], 50u);
    EXPECT_NEAR(double(on_ball[0]), double(on_ball[1]), 20);
}

TEST(FilmLayerValues, where_nothing_is_met_there_is_none) {
    Scene scene = balls_from_above();
    scene.camera.forward = {0, 0, 1};
    const auto baked = bake(scene, {});
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    RenderOptions options;
    options.spp = 4;
    options.layers = all_layers;
    const auto result = render(baked->blocks, options);
    ASSERT_TRUE(result.ok()) << result.status().message();
    for (const FilmLayerImage& layer : result->layers) {
        const float expected = layer.layer == FilmLayer::depth ? INFINITY : layer.layer == FilmLayer::samples ? 4.0f : 0.0f;
        // Squares of luminance are rounded down in fixed point.
        const float tolerance = layer.layer == FilmLayer::variance ? 1e-6f : 0.0f;
        for (const float value : layer.image.values)
            ASSERT_TRUE(value == expected || std::abs(value - expected) <= tolerance) << film_layer_name(layer.layer) << ": " << value;
    }
}

// Without a bounce there is nothing to shade, but what camera rays meet is there.
TEST(FilmLayerValues, are_there_without_bounces) {
    const auto baked = bake(balls_from_above(), {});
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    RenderOptions options;
    options.spp = 4;
    options.layers.add(FilmLayer::albedo);
    options.layers.add(FilmLayer::depth);
    const auto deep = render(baked->blocks, options);
    ASSERT_TRUE(deep.ok()) << deep.status().message();
    options.max_depth = 0;
    const auto flat = render(baked->blocks, options);
    ASSERT_TRUE(flat.ok()) << flat.status().message();
    EXPECT_EQ(flat->report.layers_hash, deep->report.layers_hash);
    EXPECT_NE(flat->report.film_hash, deep->report.film_hash);
}

// Pictures of one sample per pixel are independent of each other: what they vary by is what the layer says of each of many samples.
TEST(FilmLayerValues, variance_is_that_of_samples) {
    const auto baked = bake(reference::terrain_small(40, true, {32, 24}), {});
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    RenderOptions options;
    options.layers.add(FilmLayer::variance);
    constexpr uint32_t pictures = 24;
    constexpr size_t pixels = 32 * 24;
    std::vector<double> sum(pixels), squares(pixels);
    options.spp = 1;
    for (options.seed = 1; options.seed <= pictures; options.seed++) {
        const auto one = render(baked->blocks, options);
        ASSERT_TRUE(one.ok()) << one.status().message();
        for (size_t i = 0; i < pixels; i++) {
            const float* rgb = &one->image.values[3 * i];
            const double luminance = 0.2126729 * rgb[0] + 0.7151522 * rgb[1] + 0.0721750 * rgb[2];
            sum[i] += luminance;
            squares[i] += luminance * luminance;
            EXPECT_EQ(one->layers[0].image.values[i], 0);
        }
    }
    options.spp = 64;
    options.seed = 0;
    const auto many = render(baked->blocks, options);
    ASSERT_TRUE(many.ok()) << many.status().message();
    double found = 0, said = 0;
    for (size_t i = 0; i < pixels; i++) {
        found += (squares[i] - sum[i] * sum[i] / pictures) / (pictures - 1);
        said += double{many->layers[0].image.values[i]} * options.spp;
    }
    EXPECT_GT(said, 0);
    EXPECT_NEAR(found / said, 1, 0.1);
}

TEST(FilmLayerValues, waits_show_paging) {
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    const auto baked = bake(reference::terrain_small(64, true, {48, 32}), bake_options);
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    RenderOptions options;
    options.spp = 8;
    options.layers.add(FilmLayer::waits);
    double sums[2] = {0, 0};
    for (int i = 0; i < 2; i++) {
        options.geometry_limit_percent = i == 0 ? 100 : 5;
        const auto result = render(baked->blocks, options);
        ASSERT_TRUE(result.ok()) << result.status().message();
        for (const float value : result->layers[0].image.values) sums[i] += value;
    }
    EXPECT_GT(sums[1], 2 * sums[0]);
    EXPECT_GT(sums[1], 48 * 32);
}

}  // namespace
}  // namespace raypager
