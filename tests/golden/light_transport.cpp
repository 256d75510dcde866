// Light transport: the renderer's pictures against radiance known in closed form, and against an independent path tracer.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "film/film.hpp"
#include "raypager/materials.hpp"
#include "raypager/sky.hpp"
#include "reference/path_tracer.hpp"
#include "reference/scenes.hpp"
#include "reference/statistics.hpp"
#include "reference/textured_scenes.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

MeasuredRender render_with_report(const Scene& scene, uint32_t spp, uint32_t seed, Connection connection, double geometry_percent,
                                  const BakeOptions& baked_so = {}, Traversal traversal = Traversal::automatic) {
    const support::TemporaryFolder folder;
    BakeOptions bake_options = baked_so;
    bake_options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(scene, bake_options, folder.path(), "scene");
    if (!file.ok()) throw std::runtime_error(file.status().message());
    RenderOptions options;
    options.spp = spp;
    options.seed = seed;
    options.connection = connection;
    options.geometry_limit_percent = geometry_percent;
    options.tuning.traversal = traversal;
    auto result = render(**file, options, {});
    if (!result.ok()) throw std::runtime_error(result.status().message());
    return std::move(*result);
}

Image render_scene(const Scene& scene, uint32_t spp, uint32_t seed, Connection connection, double geometry_percent, const BakeOptions& baked_so = {},
                   Traversal traversal = Traversal::automatic) {
    return render_with_report(scene, spp, seed, connection, geometry_percent, baked_so, traversal).image;
}

double mean_of(const Image& image) {
    return std::accumulate(image.values.begin(), image.values.end(), 0.0) / static_cast<double>(image.values.size());
}

// Standard error of the picture's mean, from the spread of its values: an upper bound where the true picture is even.
double standard_error(const Image& image) {
    const double mean = mean_of(image);
    double sum = 0;
    for (const float v : image.values) sum += (v - mean) * (v - mean);
    // Channels of grey scenes carry the same noise.
    const double pixels = static_cast<double>(image.values.size()) / 3;
    return std::sqrt(sum / 3 / pixels / pixels);
}

struct FurnaceCase {
    const char* name;
    reference::FurnaceKind kind;
    double albedo;
};
void PrintTo(const FurnaceCase& c, std::ostream* out) { *out << c.name; }

class Furnaces : public testing::TestWithParam<FurnaceCase> {};

TEST_P(Furnaces, have_the_radiance_known_in_closed_form) {
    for (const uint32_t subdivisions : {0u, 3u}) {  // a sphere, and a mesh of one
        SCOPED_TRACE(subdivisions);
        const reference::Furnace furnace = reference::furnace(GetParam().kind, GetParam().albedo, 0.3, subdivisions);
        const Image image = render_scene(furnace.scene, 64, 1, Connection::queue, 0);
        const double mean = mean_of(image);
        if (GetParam().kind == reference::FurnaceKind::rough_conductor) {
            EXPECT_LE(mean, furnace.expected + 4 * standard_error(image));
            EXPECT_GT(mean, 0.8 * furnace.expected);  // GGX at alpha 0.3 loses a few percent to multiple scattering
            continue;
        }
        // Four standard errors, and float rounding (normals are quantised to 3e-5).
        EXPECT_NEAR(mean, furnace.expected, 4 * standard_error(image) + 2e-4 * furnace.expected);
    }
}

INSTANTIATE_TEST_SUITE_P(kinds, Furnaces,
                         testing::Values(FurnaceCase{"closed", reference::FurnaceKind::closed, 0.5},
                                         FurnaceCase{"closed_bright", reference::FurnaceKind::closed, 0.9},
                                         FurnaceCase{"diffuse", reference::FurnaceKind::diffuse, 0.7},
                                         FurnaceCase{"mirror", reference::FurnaceKind::mirror, 0},
                                         FurnaceCase{"rough_conductor", reference::FurnaceKind::rough_conductor, 0},
                                         FurnaceCase{"glass", reference::FurnaceKind::glass, 0}),
                         [](const auto& param) { return std::string(param.param.name); });

// Rays that leave a face must not hit it again, however long and thin it is: with distances that were wrong by millimetres, prisms 4 and 24 long had
// 0.43 and 0.34 (bench/journal/thin-faces.md).
TEST(Furnace, long_thin_faces_do_not_shade_themselves) {
    for (const double length : {0.2, 4.0, 24.0, 200.0}) {
        SCOPED_TRACE(length);
        const reference::Furnace furnace = reference::thin_prism(length);
        for (const Traversal traversal : support::traversals()) {
            const Image image = render_scene(furnace.scene, 64, 1, Connection::queue, 0, {}, traversal);
            EXPECT_NEAR(mean_of(image), furnace.expected, 4 * standard_error(image) + 2e-4 * furnace.expected);
        }
    }
}

// Paths do not end by chance where they cannot connect: each pixel of four balls is exact but for rounding; it would deviate by 0.04 (rms).
TEST(Furnace, roulette_lets_paths_through_glass) {
    const Image image = render_scene(reference::glass_row(), 64, 1, Connection::queue, 0);
    const double mean = mean_of(image), pixels = static_cast<double>(image.values.size()) / 3;
    EXPECT_NEAR(mean, 1, 4 * standard_error(image) + 2e-4);
    EXPECT_LT(standard_error(image) * std::sqrt(pixels), 1e-3);
}

struct LayeredFurnace {
    const char* name;
    std::vector<rp_material> materials;  // the last one is that of the ball
    double least, most;                  // radiance under an even sky of 1
    uint32_t max_depth = 64;
};

// White surfaces give back what they get, but for what rough ones lose to masking, and never more.
TEST(Furnace, layered_materials_give_back_what_they_get) {
    constexpr Float3 white{1, 1, 1};
    const auto plastic = [] {
        rp_material m = glossy_material({1, 1, 1}, {0.04f, 0.04f, 0.04f}, 0.3f);
        m.flags = RP_MATERIAL_BLEND;
        return m;
    }();
    const LayeredFurnace furnaces[] = {
        {"rough glass", {dielectric_material(1.5f, 0.1f, white, white)}, 0.97, 1},
        {"rougher glass", {dielectric_material(1.5f, 0.5f, white, white)}, 0.6, 1},
        {"half of what is refracted", {dielectric_material(1.5f, 0, white, {0.5f, 0.5f, 0.5f})}, 0.2, 0.5},
        {"thin", {thin_dielectric_material(1.5f)}, 1, 1},
        {"smooth coat", {coated_diffuse_material(white, 1.5f, 0)}, 1, 1, 1},
        {"dense coat", {coated_diffuse_material(white, 2.5f, 0)}, 1, 1, 1},
        {"rough coat", {coated_diffuse_material(white, 1.5f, 0.3f)}, 0.9, 1.01, 1},
        {"coated metal", {coated_conductor_material(white, {1e5f, 1e5f, 1e5f}, 0.05f, 1.5f, 0)}, 0.9, 1.005, 1},
        {"gloss", {glossy_material(white, {0.04f, 0.04f, 0.04f}, 0.3f)}, 0.85, 1, 1},
        {"substrate", {plastic}, 0.85, 1.05, 1},
        {"rough paint", {rough_diffuse_material(white, 40)}, 0.6, 1, 1},
        {"translucent", {translucent_material({0.3f, 0.3f, 0.3f}, {0.7f, 0.7f, 0.7f})}, 1, 1},
        {"clear", {clear_material()}, 1, 1},
        {"brushed metal", {clear_material(), anisotropic(conductor_of_reflectance(white, 0.3f), 0.05f)}, 0.9, 1},
        {"brushed metal under a brushed coat",
         {anisotropic(coated_conductor_material(white, {1e5f, 1e5f, 1e5f}, 0.05f, 1.5f, 0.05f), 0.2f, 0.1f)},
         0.85,
         1.02,
         1},
        {"brushed glass", {anisotropic(dielectric_material(1.5f, 0.05f, white, white), 0.3f)}, 0.85, 1},
        {"mix",
         {clear_material(), diffuse_material(white), mix_material(0, 1, 0.5f), thin_dielectric_material(1.2f), mix_material(2, 3, 0.3f)},
         1,
         1},
    };
    for (const LayeredFurnace& f : furnaces) {
        SCOPED_TRACE(f.name);
        const auto last = static_cast<uint32_t>(f.materials.size() - 1);
        const Image image = render_scene(reference::ball_under_sky(f.materials, last, f.max_depth), 64, 1, Connection::queue, 0);
        const double mean = mean_of(image), error = 4 * standard_error(image) + 3e-4;
        EXPECT_GE(mean, f.least - error);
        EXPECT_LE(mean, f.most + error);
        EXPECT_LT(standard_error(image), 0.01);
    }
}

// An image that is the same everywhere lights as no image does.
TEST(Furnace, an_even_image_is_an_even_sky) {
    for (const auto kind : {reference::FurnaceKind::diffuse, reference::FurnaceKind::glass}) {
        reference::Furnace furnace = reference::furnace(kind, 0.7, 0.3, 3);
        ASSERT_TRUE(set_sky(furnace.scene, {5, 5, 1, std::vector<float>(25, 1.0f)}).ok());
        const Image image = render_scene(furnace.scene, 64, 1, Connection::queue, 0);
        EXPECT_NEAR(mean_of(image), furnace.expected, 4 * standard_error(image) + 2e-4 * furnace.expected);
    }
}

// What is scattered sees a coarser level of a large sky, which sheds as much light.
TEST(Furnace, a_coarse_level_of_a_sky_sheds_what_the_sky_does) {
    Scene scene = reference::furnace(reference::FurnaceKind::diffuse, 0.7, 0.3, 3).scene;
    ASSERT_TRUE(set_sky(scene, reference::spotted_sky(128)).ok());
    BakeOptions paged;
    paged.resident_sky_bytes = 0;
    paged.scattered_sky_size = 40;
    const Image whole = render_scene(scene, 256, 1, Connection::queue, 0), coarse = render_scene(scene, 256, 1, Connection::queue, 20, paged);
    EXPECT_NEAR(mean_of(coarse), mean_of(whole), 0.006 * mean_of(whole));  // 262144 samples each
}

// What only shines reflects nothing, so no path goes on from it.
TEST(Furnace, no_ray_leaves_a_surface_that_absorbs_everything) {
    Scene scene = reference::furnace(reference::FurnaceKind::diffuse, 0.5, 0.3, 3).scene;
    for (rp_material& material : scene.materials) material.kind = RP_MATERIAL_ABSORBING;
    const RenderReport report = render_with_report(scene, 4, 1, Connection::queue, 0).report;
    EXPECT_GT(report.rays.camera, 0u);
    EXPECT_EQ(report.rays.bounce, 0u);
    EXPECT_EQ(report.rays.shadow, 0u);
}

// Radiance is compressed in glass, by the square of its index of refraction, and the throughput less by as much: no reason to end paths at what
// lies within. Pixels deviate by 0.010; by 0.022 when roulette ended paths for that.
TEST(Furnace, roulette_leaves_refraction_out) {
    const Image image = render_scene(reference::ball_in_glass(), 64, 1, Connection::queue, 0);
    const double mean = mean_of(image), pixels = static_cast<double>(image.values.size()) / 3;
    EXPECT_NEAR(mean, 1, 4 * standard_error(image) + 2e-4);
    EXPECT_LT(standard_error(image) * std::sqrt(pixels), 0.013);
}

// An even sky on a film that limits samples, and one that exposes longer.
TEST(FilmResponse, limits_and_exposure_are_seen_in_the_picture) {
    Scene scene;
    scene.width = scene.height = 8;
    rp_light sky = {};
    sky.kind = RP_LIGHT_INFINITE;
    sky.radiance[0] = 1;
    sky.radiance[1] = 2;
    sky.radiance[2] = 4;
    scene.lights = {sky};
    scene.materials.resize(1);
    scene.materials[0].kind = RP_MATERIAL_ABSORBING;
    scene.shapes.resize(1);
    scene.shapes[0].sphere = {{0, 0, -10}, 1};  // behind the camera
    FilmResponse exposed, dim, cut;
    exposed.exposure = 3;
    dim.max_luminance = 0.5f;
    cut.max_xyz = 1;
    cut.exposure = 2;
    for (const FilmResponse& film : {FilmResponse(), exposed, dim, cut}) {
        scene.film = film;
        const Image image = render_scene(scene, 4, 1, Connection::queue, 0);
        const auto limited = limit_sample({1, 2, 4}, film);
        for (size_t i = 0; i < image.values.size(); i++)
            ASSERT_NEAR(image.values[i], film.exposure * limited[i % 3], 1e-5) << "single precision, pixel " << i / 3;
    }
}

// Paths that end behind a shadow ray are samples as others are. They were not limited.
TEST(FilmResponse, limits_hold_for_paths_that_end_with_a_shadow_ray) {
    Scene scene = reference::two_lights_plane(reference::PlaneLights::both).scene;
    scene.film.max_luminance = 0.01f;
    const Image image = render_scene(scene, 4, 1, Connection::queue, 0);
    EXPECT_GT(mean_of(image), 0.005);
    for (size_t i = 0; i < image.values.size(); i += 3) {
        const float* const pixel = &image.values[i];
        const auto limited = limit_sample({pixel[0], pixel[1], pixel[2]}, scene.film);
        for (int c = 0; c < 3; c++) ASSERT_NEAR(pixel[c], limited[c], 1e-5) << "pixel " << i / 3;
    }
}

TEST(LitPlane, point_and_distant_light_have_known_irradiance) {
    for (const auto lights : {reference::PlaneLights::point, reference::PlaneLights::distant, reference::PlaneLights::both}) {
        const reference::LitPlane plane = reference::two_lights_plane(lights);
        const Image image = render_scene(plane.scene, 256, 1, Connection::queue, 0);
        // Over the whole picture: positions within pixels, and the choice of a light, are random.
        double expected = 0;
        constexpr int fine = 4;
        for (uint32_t y = 0; y < image.height * fine; y++)
            for (uint32_t x = 0; x < image.width * fine; x++)
                expected += plane.radiance((x + 0.5) / (image.width * fine), (y + 0.5) / (image.height * fine));
        expected /= image.width * image.height * fine * fine;
        // 262144 samples of at most about twice the mean each: a standard error of at most 0.2 %.
        EXPECT_NEAR(mean_of(image), expected, 0.008 * expected);
    }
}

using FilterKind = PixelFilter::Kind;
const PixelFilter gaussian_filter = {FilterKind::gaussian, 1.5f, 1.5f, 2}, mitchell_filter = {FilterKind::mitchell, 2, 2, 1.0f / 3, 1.0f / 3},
                  triangle_filter = {FilterKind::triangle, 2, 1}, wide_box_filter = {FilterKind::box, 1, 0.75f};

struct TransportCase {
    const char* name;
    Scene (*make)();
    Connection connection;
    bool paged_sky = false;  // although it is small
};
void PrintTo(const TransportCase& c, std::ostream* out) { *out << c.name; }

class Transport : public testing::TestWithParam<TransportCase> {};

TEST_P(Transport, agrees_with_the_reference_tracer) {
    const uint32_t spp = support::thorough() ? 256 : 64;
    const Scene scene = GetParam().make();
    const auto geometry = reference::ReferenceGeometry::build(scene);
    ASSERT_TRUE(geometry.ok()) << geometry.status().message();
    reference::ReferenceSettings settings;
    settings.spp = spp;
    settings.max_depth = scene.max_depth;
    settings.threads = 2;
    reference::ImagePair expected, candidate;
    expected.first = reference::trace_reference(scene, **geometry, settings);
    settings.seed = 2;
    expected.second = reference::trace_reference(scene, **geometry, settings);
    // Out of core, so that what is compared is what users see.
    BakeOptions options;
    if (GetParam().paged_sky) options.resident_sky_bytes = 0;
    candidate.first = render_scene(scene, spp, 11, GetParam().connection, 25, options);
    candidate.second = render_scene(scene, spp, 12, GetParam().connection, 25, options);
    // Normals are stored with 3e-5 radians: their effect on radiance stays below this share.
    const auto comparison = reference::compare_statistically(candidate, expected, {.relative_tolerance = 0.002});
    EXPECT_TRUE(comparison.agrees()) << comparison.describe();
    std::printf("%s: %s\n", GetParam().name, comparison.describe().c_str());
}

INSTANTIATE_TEST_SUITE_P(
    scenes, Transport,
    testing::Values(
        TransportCase{"cornell_spheres",
                      [] {
                          return reference::cornell_small({.sphere_primitives = true}, {48, 48});
                      },
                      Connection::queue},
        TransportCase{"cornell_smooth",
                      [] {
                          return reference::cornell_small({.smooth_normals = true}, {48, 48});
                      },
                      Connection::queue},
        TransportCase{"coated_balls", [] { return reference::coated_balls(); }, Connection::queue},
        TransportCase{"clear_balls", [] { return reference::clear_balls(); }, Connection::queue},
        TransportCase{"textures",
                      [] {
                          return reference::textured_room(false, {48, 36});
                      },
                      Connection::queue},
        TransportCase{"cutouts",
                      [] {
                          return reference::textured_room(true, {48, 36});
                      },
                      Connection::queue},
        TransportCase{"brushed",
                      [] {
                          return reference::brushed_small(24, {64, 48});
                      },
                      Connection::queue},
        TransportCase{"clear_balls_roulette", [] { return reference::clear_balls(); }, Connection::roulette},
        TransportCase{"cornell_unseen",
                      [] {
                          return reference::cornell_unseen({48, 48});
                      },
                      Connection::queue},
        TransportCase{"sky",
                      [] {
                          return reference::sky_small(48, {64, 48});
                      },
                      Connection::queue},
        TransportCase{"sky_roulette",
                      [] {
                          return reference::sky_small(48, {64, 48});
                      },
                      Connection::roulette},
        TransportCase{"paged_sky",
                      [] {
                          return reference::sky_small(48, {64, 48}, 150);
                      },
                      Connection::queue, true},
        TransportCase{"lamps",
                      [] {
                          return reference::lamps_small({48, 48});
                      },
                      Connection::queue},
        TransportCase{"terrain",
                      [] {
                          return reference::terrain_small(48, true, {64, 48});
                      },
                      Connection::queue},
        TransportCase{"clutter",
                      [] {
                          return reference::clutter_small(60, 3, {64, 48});
                      },
                      Connection::queue},
        TransportCase{"lens", [] { return reference::balls_on_a_floor(reference::ViewKind::lens); }, Connection::queue},
        TransportCase{"orthographic", [] { return reference::balls_on_a_floor(reference::ViewKind::orthographic, mitchell_filter); },
                      Connection::queue},
        TransportCase{"orthographic_lens", [] { return reference::balls_on_a_floor(reference::ViewKind::orthographic_lens); }, Connection::queue},
        TransportCase{"equirectangular", [] { return reference::balls_on_a_floor(reference::ViewKind::equirectangular, gaussian_filter); },
                      Connection::queue},
        TransportCase{"equal_area", [] { return reference::balls_on_a_floor(reference::ViewKind::equal_area, triangle_filter); }, Connection::queue},
        TransportCase{"shifted", [] { return reference::balls_on_a_floor(reference::ViewKind::shifted, wide_box_filter); }, Connection::roulette},
        TransportCase{"cornell_roulette",
                      [] {
                          return reference::cornell_small({.sphere_primitives = true}, {48, 48});
                      },
                      Connection::roulette},
        TransportCase{"clutter_roulette",
                      [] {
                          return reference::clutter_small(60, 3, {64, 48});
                      },
                      Connection::roulette}),
    [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace raypager
