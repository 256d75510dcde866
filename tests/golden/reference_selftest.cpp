// The reference path tracer against what is known exactly. Monte Carlo results: the mean over a region must lie within 4.5 standard
// deviations of the expected value, estimated from the spread of the region's pixels (7 in a million false alarms; seeds are fixed, so
// a passing test stays passing). Where no noise is possible, the tolerance is float rounding.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "reference/bsdf.hpp"
#include "reference/path_tracer.hpp"
#include "reference/scene_builder.hpp"
#include "reference/scenes.hpp"

namespace raypager::reference {
namespace {

constexpr double sigmas = 4.5;

struct Estimate {
    double mean = 0, sigma = 0;  // sigma of the mean
};

// Of differences between pixels and their expected values.
template <class Expected>
Estimate mean_error(const Image& image, int channel, const Expected& expected) {
    double sum = 0, sum2 = 0;
    const double n = double(image.width) * image.height;
    for (uint32_t y = 0; y < image.height; y++) {
        for (uint32_t x = 0; x < image.width; x++) {
            const double error = double(image.values[3 * (size_t{y} * image.width + x) + channel]) - expected(x, y);
            sum += error;
            sum2 += error * error;
        }
    }
    const double mean = sum / n;
    return {mean, std::sqrt(std::max(0.0, sum2 / n - mean * mean) / (n - 1))};
}

Estimate furnace_error(const Furnace& furnace, uint32_t spp, uint64_t seed = 1) {
    const Image image = trace_reference(furnace.scene, {.spp = spp, .max_depth = furnace.scene.max_depth, .seed = seed, .threads = 2}).value();
    return mean_error(image, 1, [&](uint32_t, uint32_t) { return furnace.expected; });
}

// Plus the rounding of pixels to float and of the scene's numbers.
void expect_zero(const Estimate& error, double scale, const std::string& what) {
    EXPECT_LE(std::abs(error.mean), sigmas * error.sigma + 1e-6 * scale)
        << what << ": off by " << error.mean << ", one sigma is " << error.sigma << ", of " << scale;
    EXPECT_LT(error.sigma, 0.01 * scale) << what << ": too noisy to say anything";
}

TEST(ReferenceFurnace, ClosedSphereShinesTheGeometricSeries) {
    for (const double albedo : {0.0, 0.5, 0.8, 1.0}) {
        for (const uint32_t subdivisions : {0u, 3u}) {
            const Furnace furnace = reference::furnace(FurnaceKind::closed, albedo, 0, subdivisions);
            const Estimate error = furnace_error(furnace, 16);
            expect_zero(error, furnace.expected, fmt::format("albedo {}, {} subdivisions", albedo, subdivisions));
        }
    }
}

TEST(ReferenceFurnace, ClosedSphereAtEveryDepth) {
    Furnace furnace = reference::furnace(FurnaceKind::closed, 0.7);
    for (uint32_t depth = 0; depth <= 3; depth++) {
        furnace.scene.max_depth = depth;
        furnace.expected = (1 - std::pow(0.7, depth + 1)) / 0.3;
        expect_zero(furnace_error(furnace, 16), furnace.expected, fmt::format("max depth {}", depth));
    }
}

TEST(ReferenceFurnace, BallsUnderAnEvenSky) {
    for (const uint32_t subdivisions : {0u, 3u}) {
        for (const FurnaceKind kind : {FurnaceKind::diffuse, FurnaceKind::mirror, FurnaceKind::glass}) {
            const Furnace furnace = reference::furnace(kind, 0.6, 0, subdivisions);
            const double left = kind == FurnaceKind::mirror ? 1e-9 : kind == FurnaceKind::glass ? 1e-4 : 0;
            const Estimate error = furnace_error(furnace, 64);
            expect_zero({error.mean, error.sigma + left}, furnace.expected, fmt::format("kind {}, {} subdivisions", int(kind), subdivisions));
        }
    }
}

// Radiance inside glass of index n is n^2 times that outside. Seen from the middle, rays meet the surface at right angles, and what is
// reflected comes back by way of the middle.
TEST(ReferenceFurnace, GlassConcentratesRadianceInside) {
    Furnace furnace = reference::furnace(FurnaceKind::glass);
    furnace.scene.camera.eye = {0, 0, 0};
    furnace.expected = 1.5 * 1.5;
    expect_zero(furnace_error(furnace, 16), furnace.expected, "inside");
}

// Single scattering loses what is masked; more of it the rougher the metal, and nothing is ever gained.
TEST(ReferenceFurnace, RoughMetalGainsNothing) {
    double before = 1;
    for (const double alpha : {0.05, 0.2, 0.5, 1.0}) {
        const Furnace furnace = reference::furnace(FurnaceKind::rough_conductor, 0, alpha, 0);
        const Estimate error = furnace_error(furnace, 64);
        EXPECT_LE(error.mean, sigmas * error.sigma) << "alpha " << alpha;
        const double reflected = 1 + error.mean;
        EXPECT_LT(reflected, before + sigmas * error.sigma) << "alpha " << alpha;
        EXPECT_GT(reflected, 1 - std::log(2)) << "alpha " << alpha;  // alpha 1 at normal incidence; more at all other angles
        before = reflected;
    }
}

TEST(ReferenceLights, PointAndDistantLightOnAPlane) {
    for (const PlaneLights lights : {PlaneLights::both, PlaneLights::point, PlaneLights::distant}) {
        const LitPlane plane = two_lights_plane(lights);
        const Image image = trace_reference(plane.scene, {.spp = 64, .max_depth = 1, .threads = 2}).value();
        const auto expected = [&](uint32_t x, uint32_t y) {
            double sum = 0;  // over the pixel; smooth, so 4 x 4 points tell its mean to 1e-5
            for (int i = 0; i < 16; i++) sum += plane.radiance((x + (i % 4 + 0.5) / 4) / image.width, (y + (i / 4 + 0.5) / 4) / image.height);
            return sum / 16;
        };
        for (int channel = 0; channel < 3; channel++) {
            expect_zero(mean_error(image, channel, expected), 0.7, fmt::format("lights {}, channel {}", int(lights), channel));
        }
        if (lights == PlaneLights::both) continue;
        // A single light is not chosen at random: what is left is the variation within a pixel, a few percent, over the root of 64.
        for (uint32_t i = 0; i < 32; i++) EXPECT_NEAR(image.values[3 * (i * 32 + i)], expected(i, i), 0.02 * expected(i, i)) << "pixel " << i;
    }
}

// A square light of radiance 1 at height h over a diffuse floor; the form factor from a point below its middle is known
// (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3): four times that of a corner.
TEST(ReferenceLights, SquareAboveAFloor) {
    constexpr double half = 0.5, height = 0.8, albedo = 0.5;
    const double x = half / height, root = std::sqrt(1 + x * x);
    const double form_factor = 4 * (2 * x / root * std::atan(x / root)) / (2 * pi);
    for (const bool as_seen_from_behind : {false, true}) {
        SceneBuilder builder({16, 16});
        // A narrow view along a slanting line, so that the light is not in the way.
        builder.camera({0, 0.5, 6}, {0, 0, 0}, {0, 1, 0}, 0.01);
        builder.add("floor", quad({-9, 0, 9}, {18, 0, 0}, {0, 0, -18}), builder.material(diffuse(Vec3(albedo))));
        Shape& light = builder.add("light", quad({-half, height, -half}, {2 * half, 0, 0}, {0, 0, 2 * half}, 3), builder.material(absorber()));
        light.reverse_orientation = as_seen_from_behind;
        builder.shine(light, Vec3(1));
        const Image image = trace_reference(builder.finish(), {.spp = 256, .max_depth = 1, .threads = 2}).value();
        const double expected = as_seen_from_behind ? 0 : albedo * form_factor;
        expect_zero(mean_error(image, 0, [&](uint32_t, uint32_t) { return expected; }), 0.3, fmt::format("behind {}", as_seen_from_behind));
    }
}

// A ball of radius r at distance d shines like a point: irradiance pi L (r / d)^2 at normal incidence.
TEST(ReferenceLights, BallAboveAFloor) {
    constexpr double radius = 0.4, distance = 1.1, albedo = 0.5;
    SceneBuilder builder({16, 16});
    builder.camera({0, 0.5, 6}, {0, 0, 0}, {0, 1, 0}, 0.01);
    builder.add("floor", quad({-9, 0, 9}, {18, 0, 0}, {0, 0, -18}), builder.material(diffuse(Vec3(albedo))));
    builder.shine(builder.add_sphere("light", {0, distance, 0}, radius, builder.material(absorber())), Vec3(1));
    const Image image = trace_reference(builder.finish(), {.spp = 256, .max_depth = 1, .threads = 2}).value();
    const double expected = albedo * radius * radius / (distance * distance);
    expect_zero(mean_error(image, 0, [&](uint32_t, uint32_t) { return expected; }), 0.1, "ball");
}

// A point light straight above a floor, with nothing, something beside, or something between them. Glass casts a full shadow, too.
TEST(ReferenceLights, AnythingCastsAShadow) {
    constexpr double height = 2, albedo = 0.5, lit = albedo / pi * 8 / (height * height);
    const struct {
        const char* name;
        Vec3 corner;
        rp_material material;
        double expected;
    } cases[] = {{"beside", {1, 1, -1}, diffuse(Vec3()), lit},
                 {"behind the light", {-1, 3, -1}, diffuse(Vec3()), lit},
                 {"black", {-1, 1, -1}, diffuse(Vec3()), 0},
                 {"glass", {-1, 1, -1}, glass(1.5), 0},
                 {"just below the light", {-1, 1.9999, -1}, diffuse(Vec3()), 0},
                 {"just above the floor", {-1, 0.0001, -0.005}, diffuse(Vec3()), 0}};
    for (const auto& c : cases) {
        SceneBuilder builder({8, 8});
        builder.camera({0, 0.5, 6}, {0, 0, 0}, {0, 1, 0}, 0.0001);
        builder.add("floor", quad({-9, 0, 9}, {18, 0, 0}, {0, 0, -18}), builder.material(diffuse(Vec3(albedo))));
        // The lowest one reaches only so far towards the camera that it does not hide the floor's middle, 0.0012 in front of it.
        builder.add(c.name, quad(c.corner, {2, 0, 0}, {0, 0, c.corner.y < 0.01 ? 0.0055 : 2}), builder.material(c.material));
        builder.point_light({0, height, 0}, Vec3(8));
        const Image image = trace_reference(builder.finish(), {.spp = 4, .max_depth = 1}).value();
        expect_zero(mean_error(image, 0, [&](uint32_t, uint32_t) { return c.expected; }), lit, c.name);
    }
}

// Densities must fit the sampler: the weight f cos / pdf averages to the same albedo as f cos over all directions.
TEST(ReferenceBsdf, SamplingFitsEvaluation) {
    Random random(17);
    const Vec3 normal = normalized(Vec3(0.3, -0.5, 0.8));
    const Frame frame(normal);
    for (const double alpha : {0.1, 0.4, 0.9, -0.2}) {  // the last: in two directions
        rp_material metal = conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, std::abs(alpha));
        if (alpha < 0) RP_ALPHA_ACROSS(metal) = 0.6f;
        for (const double cosine : {0.95, 0.5, 0.1}) {
            const ScatterPoint point{frame.to_world({std::sqrt(1 - cosine * cosine), 0, cosine}), normal, normal, true, {1, 2, 3}};
            constexpr int n = 400000;
            double sampled = 0, sampled2 = 0, integrated = 0, integrated2 = 0, density = 0, density2 = 0;
            for (int i = 0; i < n; i++) {
                const auto s = sample(metal, point, random);
                const double a = s ? s->weight.x : 0;
                sampled += a, sampled2 += a * a;
                const double u = random.uniform(), v = random.uniform();
                const Vec3 local = uniform_sphere(u, v);
                const Vec3 wi = frame.to_world({local.x, local.y, std::abs(local.z)});
                const double b = evaluate(metal, point, wi).x * 2 * pi, p = pdf(metal, point, wi) * 2 * pi;
                integrated += b, integrated2 += b * b;
                density += p, density2 += p * p;
            }
            const auto sigma = [&](double sum, double sum2) { return std::sqrt((sum2 / n - sum / n * (sum / n)) / n); };
            const double error = std::hypot(sigma(sampled, sampled2), sigma(integrated, integrated2));
            EXPECT_NEAR(sampled / n, integrated / n, sigmas * error) << "alpha " << alpha << " cosine " << cosine;
            EXPECT_LE(density / n, 1 + sigmas * sigma(density, density2)) << "alpha " << alpha << " cosine " << cosine;
        }
    }
}

TEST(ReferenceBsdf, GlassRefractsBySnellsLaw) {
    Random random(29);
    const Vec3 normal = normalized(Vec3(-0.2, 0.9, 0.4));
    const Frame frame(normal);
    for (const bool outside : {true, false}) {
        for (const double sine : {0.0, 0.3, 0.6}) {
            const Vec3 wo = frame.to_world({sine, 0, std::sqrt(1 - sine * sine)});
            int transmitted = 0;
            for (int i = 0; i < 100; i++) {
                const std::optional<ScatterSample> s = sample(glass(1.5), {wo, normal, normal, outside}, random);
                ASSERT_TRUE(s.has_value());
                const Vec3 wi = frame.to_local(s->wi);
                EXPECT_NEAR(wi.y, 0, 1e-12);
                transmitted += wi.z < 0;
                const double expected = wi.z > 0 ? sine : outside ? sine / 1.5 : sine * 1.5;
                EXPECT_NEAR(wi.x, -expected, 1e-12) << "outside " << outside << " sine " << sine;
            }
            EXPECT_GT(transmitted, 50);
        }
    }
}

// With alpha 1 the density of normals is 1 / pi throughout, and the share reflected at normal incidence is the integral of
// c / (1 + c) over the cosine c: 1 - ln 2.
TEST(ReferenceBsdf, RoughestMetalAtNormalIncidence) {
    Random random(23);
    const Vec3 normal(0, 0, 1);
    const rp_material metal = conductor(Vec3(1), Vec3(1e5), 1);
    double sum = 0, sum2 = 0;
    constexpr int n = 200000;
    for (int i = 0; i < n; i++) {
        const auto s = sample(metal, {normal, normal, normal}, random);
        const double weight = s ? s->weight.x : 0;
        sum += weight, sum2 += weight * weight;
    }
    const double mean = sum / n, sigma = std::sqrt((sum2 / n - mean * mean) / n);
    EXPECT_NEAR(mean, 1 - std::log(2), sigmas * sigma);
    EXPECT_LT(sigma, 1e-3);
}

TEST(ReferenceBsdf, FresnelAtKnownAngles) {
    EXPECT_NEAR(fresnel_dielectric(1, 1.5), 0.04, 1e-12);
    EXPECT_NEAR(fresnel_dielectric(1, 1 / 1.5), 0.04, 1e-12);
    EXPECT_NEAR(fresnel_dielectric(1e-9, 1.5), 1, 1e-6);
    // Brewster's angle: light polarised in the plane of incidence is not reflected, the other is by ((n^2 - 1) / (n^2 + 1))^2.
    const double brewster = std::cos(std::atan(1.5)), perpendicular = (1.5 * 1.5 - 1) / (1.5 * 1.5 + 1);
    EXPECT_NEAR(fresnel_dielectric(brewster, 1.5), perpendicular * perpendicular / 2, 1e-12);
    EXPECT_EQ(fresnel_dielectric(0.5, 1 / 1.5), 1) << "total reflection";
    EXPECT_NEAR(fresnel_conductor(1, 0.2, 3.9), ((0.8 * 0.8) + 3.9 * 3.9) / ((1.2 * 1.2) + 3.9 * 3.9), 1e-12);
    for (const double cosine : {0.1, 0.4, 0.8}) EXPECT_NEAR(fresnel_conductor(cosine, 1.5, 0), fresnel_dielectric(cosine, 1.5), 1e-12);
}

TEST(ReferencePathTracer, SeedsDifferAndThreadsDoNot) {
    const Scene scene = cornell_small({.subdivisions = 1, .wall_divisions = 1});
    const ReferenceSettings settings{.width = 16, .height = 12, .spp = 2, .seed = 4};
    ReferenceSettings more_threads = settings, other_seed = settings;
    more_threads.threads = 3;
    other_seed.seed = 5;
    const Image image = trace_reference(scene, settings).value();
    EXPECT_EQ(image.values, trace_reference(scene, more_threads).value().values);
    EXPECT_NE(image.values, trace_reference(scene, other_seed).value().values);
}

// Each scene shows something bright and something dark from its camera, and no picture holds a NaN or a negative value.
TEST(ReferencePathTracer, AllScenesCanBeSeen) {
    const std::pair<const char*, Scene> scenes[] = {
        {"cornell", cornell_small()},     {"cornell with spheres", cornell_small({.sphere_primitives = true})},
        {"terrain", terrain_small(32)},   {"smooth terrain", terrain_small(32, true)},
        {"clutter", clutter_small(60)},   {"soup", soup()},
        {"shared edges", shared_edges()}, {"shells", overlapping_shells()},
    };
    for (const auto& [name, scene] : scenes) {
        const Image image = trace_reference(scene, {.width = 32, .height = 24, .spp = 8, .max_depth = scene.max_depth, .threads = 2}).value();
        double sum = 0, lowest = infinity, highest = 0;
        for (const float value : image.values) {
            ASSERT_TRUE(std::isfinite(value) && value >= 0) << name;
            sum += double(value);
            lowest = std::min(lowest, double(value));
            highest = std::max(highest, double(value));
        }
        const double mean = sum / static_cast<double>(image.values.size());
        EXPECT_GT(mean, 0.05) << name;
        EXPECT_LT(mean, 3) << name;
        EXPECT_GT(highest, 2 * lowest) << name;
    }
}

}  // namespace
}  // namespace raypager::reference
