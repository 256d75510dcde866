// Lights of pbrt scenes: images of skies and lamps, cones, powers.
#include <cmath>
#include <numbers>

#include "raypager/sky.hpp"
#include "unit/pbrt_fixture.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

// Red for +x, green for +y, blue for +z, and the opposite of each without it.
Float3 axis_color(const std::array<double, 3>& d) {
    const double x = std::abs(d[0]), y = std::abs(d[1]), z = std::abs(d[2]);
    if (x >= y && x >= z) return d[0] > 0 ? Float3{1, 0, 0} : Float3{0, 1, 1};
    if (y >= z) return d[1] > 0 ? Float3{0, 1, 0} : Float3{1, 0, 1};
    return d[2] > 0 ? Float3{0, 0, 1} : Float3{1, 1, 0};
}

class PbrtLights : public test::PbrtTest {
protected:
    // direction_of: what a place in [0, 1]^2 stands for.
    template <class Direction>
    void write(const std::string& name, uint32_t width, uint32_t height, const Direction& direction_of) {
        Image image{width, height, 3, {}};
        for (uint32_t y = 0; y < height; y++)
            for (uint32_t x = 0; x < width; x++) {
                const Float3 c = axis_color(direction_of((x + 0.5) / width, (y + 0.5) / height));
                image.values.insert(image.values.end(), {c.x, c.y, c.z});
            }
        ASSERT_TRUE(write_image(folder / name, image).ok());
    }
    void write_axes() {
        write("square.pfm", 64, 64, sky_direction);
        write("globe.pfm", 128, 64, [](double u, double v) {
            const double polar = pi * v, turn = 2 * pi * u;
            return std::array{std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)};
        });
    }
    static std::string sky(const std::string& parameters, const std::string& transform = "") {
        return "WorldBegin AttributeBegin " + transform + " LightSource \"infinite\" " + parameters + " AttributeEnd " + test::one_triangle;
    }
    static const rp_light& light_of(const Scene& scene) { return scene.lights.at(0); }
    // What a sky of this scene shows in a direction of the world.
    static Float3 seen(const Scene& scene, const std::array<double, 3>& d) {
        const rp_light& light = light_of(scene);
        const auto along = [&](const float(&a)[3]) { return a[0] * d[0] + a[1] * d[1] + a[2] * d[2]; };
        const LightImage& packed = *scene.light_images.at(0);
        Image image{packed.width, packed.height, 3, {}};
        for (const rp_texel& texel : packed.texels) {
            const Float3 c = texel_color(texel);
            image.values.insert(image.values.end(), {c.x, c.y, c.z});
        }
        return sky_color(image, {along(light.p), along(light.e1), along(light.e2)});
    }
    static void expect_color(const Float3& color, const Float3& expected) {
        EXPECT_NEAR(color.x, expected.x, 1e-4);
        EXPECT_NEAR(color.y, expected.y, 1e-4);
        EXPECT_NEAR(color.z, expected.z, 1e-4);
    }
    // world: which axis of the light's space lies there.
    static void expect_axes(const Scene& scene, const std::array<std::array<double, 3>, 3>& world) {
        const Float3 colors[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, opposite[] = {{0, 1, 1}, {1, 0, 1}, {1, 1, 0}};
        for (size_t i = 0; i < 3; i++) {
            SCOPED_TRACE(i);
            expect_color(seen(scene, world[i]), colors[i]);
            expect_color(seen(scene, {-world[i][0], -world[i][1], -world[i][2]}), opposite[i]);
        }
    }
};

TEST(Skies, places_are_those_of_pbrt) {
    const auto expect_place = [](const std::array<double, 3>& direction, double u, double v) {
        const auto place = sky_place(direction);
        EXPECT_NEAR(place[0], u, 1e-12);
        EXPECT_NEAR(place[1], v, 1e-12);
    };
    expect_place({0, 0, 1}, 0.5, 0.5);
    expect_place({0, 0, 5}, 0.5, 0.5);
    expect_place({1, 0, 0}, 1, 0.5);
    expect_place({-1, 0, 0}, 0, 0.5);
    expect_place({0, 1, 0}, 0.5, 1);
    expect_place({0, -1, 0}, 0.5, 0);
    const double half = std::sqrt(0.5);
    expect_place({half, half, 0}, 0.75, 0.75);
    for (int i = 0; i < 400; i++) {
        const double u = (i % 20 + 0.5) / 20, v = (i / 20 + 0.5) / 20;
        const auto d = sky_direction(u, v);
        EXPECT_NEAR(std::hypot(d[0], d[1], d[2]), 1, 1e-12);
        expect_place(d, u, v);
    }
    const auto corner = sky_direction(1, 1);
    EXPECT_NEAR(corner[2], -1, 1e-12);
}

TEST(Skies, texels_keep_sixteen_bits_of_any_float) {
    for (const float x : {1e-30f, 0.001f, 0.5f, 1.0f, 65504.0f, 1e9f, 3e38f, 0.99999994f}) {
        const Float3 c = texel_color(texel_of({x, x / 2, 0}));
        EXPECT_NEAR(c.x, x, x * 0x1p-16);
        EXPECT_NEAR(c.y, x / 2, x * 0x1p-16);
        EXPECT_EQ(c.z, 0);
    }
    EXPECT_EQ(texel_color(texel_of({0, 0, 0})), (Float3{0, 0, 0}));
}

TEST_F(PbrtLights, SkiesOfBothVersionsAreTheRightWayRound) {
    write_axes();
    const std::array<std::array<double, 3>, 3> as_they_are = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    expect_axes(expect_silence(sky("\"string filename\" \"square.pfm\"")), as_they_are);
    expect_axes(expect_silence(sky("\"string mapname\" \"globe.pfm\"")), as_they_are);
    expect_axes(expect_warning(sky("\"string filename\" \"globe.pfm\""), "map of a globe"), as_they_are);
    const std::string square = "\"string filename\" \"square.pfm\"";
    expect_axes(expect_silence(sky(square, "Rotate 90 0 0 1")), {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}});
    expect_axes(expect_silence(sky(square, "Rotate -90 1 0 0")), {{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}});
    expect_axes(expect_silence(sky(square, "Scale -1 1 1")), {{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
    expect_axes(expect_silence(sky(square, "Scale 3 3 3 Translate 1 2 3")), as_they_are);
    expect_axes(expect_warning(sky(square, "Scale 1 1 2"), "stretches"), as_they_are);
    expect_error(sky(square, "Scale 0 1 1"), "scene.pbrt:1");
}

TEST_F(PbrtLights, SkiesAreScaledAndAddedUp) {
    write_axes();
    const Scene scaled = expect_warning(sky("\"string filename\" \"square.pfm\" \"rgb L\" [2 3 4] \"float scale\" 0.5"), "multiplied");
    expect_color(seen(scaled, {1, 0, 0}), {1, 0, 0});
    expect_color(seen(scaled, {-1, 0, 0}), {0, 1.5, 2});
    EXPECT_NEAR(light_of(scaled).radiance[2], 1, 0.1);  // half of all axes are blue
    EXPECT_EQ(scaled.files.size(), 2u) << "a change of the image is one of the scene";

    const std::string two = "WorldBegin LightSource \"infinite\" \"rgb L\" [1 1 1] LightSource \"infinite\" \"string filename\" \"square.pfm\" ";
    const Scene with_constant = expect_silence(two + test::one_triangle);
    ASSERT_EQ(with_constant.lights.size(), 1u);
    expect_color(seen(with_constant, {1, 0, 0}), {2, 1, 1});
    const Scene both =
        expect_warning(two + "Rotate 90 0 0 1 LightSource \"infinite\" \"string mapname\" \"globe.pfm\"" + test::one_triangle, "added up");
    ASSERT_EQ(both.lights.size(), 1u);
    expect_color(seen(both, {0, 1, 0}), {2, 2, 1});
    expect_color(seen(both, {0, 0, -1}), {3, 3, 1});

    ASSERT_TRUE(write_image(folder / "grey.pfm", {64, 64, 1, std::vector<float>(4096, 0.25f)}).ok());
    const Scene lit = expect_silence(sky("\"string filename\" \"grey.pfm\" \"float illuminance\" 10"));
    // As pbrt-v4 has it, with half of a pixel's solid angle.
    EXPECT_NEAR(seen(lit, {1, 0, 0}).x, 10 / (pi / 2), 0.05);
}

TEST_F(PbrtLights, BadImagesAreErrorsOfTheirLine) {
    expect_error(sky("\"string filename\" \"absent.pfm\""), "scene.pbrt:1");
    expect_error(sky("\"string filename\" \"absent.pfm\""), "absent.pfm");
    folder.write("text.pfm", "no picture");
    expect_error(sky("\"string filename\" \"text.pfm\""), "text.pfm");
    folder.write("huge.pfm", "PF\n60000 60000\n-1\n....");
    expect_error(sky("\"string mapname\" \"huge.pfm\""), "60000 x 60000");
    ASSERT_TRUE(write_image(folder / "odd.pfm", {7, 5, 1, std::vector<float>(35, 1.0f)}).ok());
    expect_error(sky("\"string filename\" \"odd.pfm\""), "7 x 5");
    expect_silence(sky("\"string mapname\" \"odd.pfm\""));  // version 3 takes any
    ASSERT_TRUE(write_image(folder / "bad.pfm", {2, 2, 1, {1, NAN, -3, INFINITY}}).ok());
    const Scene scene = expect_warning(sky("\"string filename\" \"bad.pfm\""), "3 values of \"bad.pfm\"");
    EXPECT_NEAR(light_of(scene).radiance[0], 0.25, 1e-5);
    ASSERT_TRUE(write_image(folder / "bright.pfm", {1, 1, 1, {3e38f}}).ok());
    expect_error(sky("\"string filename\" \"bright.pfm\" \"float scale\" 1000"), "too bright");
    ASSERT_TRUE(write_image(folder / "black.pfm", {2, 2, 1, {0, 0, 0, 0}}).ok());
    expect_error(sky("\"string filename\" \"black.pfm\" \"float illuminance\" 3"), "black above");
    expect_warning(sky("\"string filename\" \"black.pfm\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0 1 0]"), "portal");
}

TEST_F(PbrtLights, SpotsHaveConesOfEitherVersion) {
    const auto spot = [&](const std::string& before, const std::string& parameters) {
        return expect_silence(before + "WorldBegin Translate 1 0 0 LightSource \"spot\" \"rgb I\" [2 4 6] " + parameters + " " + test::one_triangle);
    };
    const Scene plain = spot("", "\"point3 from\" [0 0 0] \"point3 to\" [0 0 -3]");
    EXPECT_EQ(light_of(plain).kind, RP_LIGHT_SPOT);
    EXPECT_EQ(light_of(plain).p[0], 1);
    EXPECT_FLOAT_EQ(light_of(plain).e1[2], -1);
    EXPECT_FLOAT_EQ(light_of(plain).e2[0], static_cast<float>(std::cos(pi / 6)));
    EXPECT_FLOAT_EQ(light_of(plain).e2[1], static_cast<float>(std::cos(25 * pi / 180)));
    EXPECT_EQ(light_of(plain).e2[2], 0);
    EXPECT_EQ(light_of(plain).radiance[1], 4);
    EXPECT_EQ(light_of(expect_warning("SurfaceIntegrator \"path\" WorldBegin LightSource \"spot\"" + test::one_triangle, "path tracing")).e2[2], 1);
    const Scene power = spot("", "\"float power\" 10 \"float coneangle\" 60 \"float conedeltaangle\" 0");
    EXPECT_FLOAT_EQ(light_of(power).radiance[0], static_cast<float>(2 * 10 / pi));
    expect_error("WorldBegin LightSource \"spot\" \"float coneangle\" 0 " + test::one_triangle, "coneangle");
    expect_error("WorldBegin LightSource \"spot\" \"point3 to\" [0 0 0]" + test::one_triangle, "different points");
}

TEST_F(PbrtLights, LampsWithImages) {
    write_axes();
    const Scene lamp =
        expect_silence("WorldBegin LightSource \"goniometric\" \"string mapname\" \"globe.pfm\" \"rgb I\" [2 2 2]" + test::one_triangle);
    const rp_light& light = light_of(lamp);
    EXPECT_EQ(light.kind, RP_LIGHT_POINT);
    EXPECT_EQ(light.flags, 1u << RP_LIGHT_IMAGE_SHIFT | RP_LIGHT_MIRRORED);
    // The image's z axis is the light's y axis.
    EXPECT_EQ(light.e1[0], 1);
    EXPECT_EQ(light.e2[2], 1);
    EXPECT_NEAR(light.radiance[0], 1, 0.02);  // half of the image is of each colour
    const Scene slide =
        expect_silence("WorldBegin LightSource \"projection\" \"string filename\" \"globe.pfm\" \"float power\" 5 " + test::one_triangle);
    EXPECT_EQ(light_of(slide).kind, RP_LIGHT_PROJECTION);
    EXPECT_FLOAT_EQ(light_of(slide).e1[0], 2);
    EXPECT_FLOAT_EQ(light_of(slide).e2[1], 1);
    EXPECT_EQ(light_of(slide).flags & RP_LIGHT_MIRRORED, 0u);
    expect_error("WorldBegin LightSource \"projection\"" + test::one_triangle, "needs an image");
    expect_error("WorldBegin LightSource \"projection\" \"string filename\" \"none.pfm\"" + test::one_triangle, "none.pfm");
    expect_warning("WorldBegin LightSource \"goniometric\"" + test::one_triangle, "without an image");
}

TEST_F(PbrtLights, PowersOfAreaLights) {
    const Scene scene = expect_silence("WorldBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"float power\" 8 \"bool twosided\" true " +
                                       test::one_triangle + "Shape \"disk\" \"float radius\" 2");
    ASSERT_EQ(scene.area_lights.size(), 2u);
    EXPECT_EQ(scene.area_lights[0].power, 8);  // of each triangle
    EXPECT_EQ(scene.area_lights[1].power, 0);  // of the disk as a whole
    EXPECT_NEAR(scene.area_lights[1].radiance.y, 2 * 8 / (2 * pi * pi * 4), 1e-3);
    write_axes();
    const Scene image =
        expect_warning("WorldBegin AreaLightSource \"diffuse\" \"string filename\" \"square.pfm\" " + test::one_triangle, "mean colour");
    EXPECT_NEAR(image.area_lights.at(0).radiance.x, 0.5, 0.02);
}

}  // namespace
}  // namespace raypager
