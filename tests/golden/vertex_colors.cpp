// Colours at the vertices of meshes: what they stand for, and how they are interpolated.
#include <gtest/gtest.h>

#include <cmath>

#include "block/point_code.hpp"
#include "reference/scene_builder.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"

namespace raypager {
namespace {

MeasuredRender draw(const Scene& scene, uint32_t spp, Traversal traversal, double percent = 100) {
    const support::TemporaryFolder folder;
    BakeOptions options;
    options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(scene, options, folder.path(), "scene");
    if (!file.ok()) throw std::runtime_error(file.status().message());
    RenderOptions render_options;
    render_options.spp = spp;
    render_options.tuning.traversal = traversal;
    render_options.geometry_limit_percent = percent;
    auto result = render(**file, render_options, {});
    if (!result.ok()) throw std::runtime_error(result.status().message());
    return std::move(*result);
}

// A square of two triangles seen from straight above, which fills the picture, under an even sky of radiance 1: each point shines with its
// reflectance. colors: of the corners, from the lower left counter-clockwise.
Scene painted_square(const std::vector<uint32_t>& colors, const rp_material& material) {
    reference::SceneBuilder scene({16, 16});
    TriangleMesh square;
    square.positions = {{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    square.colors = colors;
    scene.add("square", square, scene.material(material));
    scene.camera({0, 1, 0}, {0, 0, 0}, {0, 0, -1}, 90);
    scene.infinite_light({1, 1, 1});
    Scene result = scene.finish();
    result.max_depth = 1;
    return result;
}

double linear_of_srgb(uint32_t byte) {
    const double v = byte / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

TEST(VertexColors, are_srgb_and_interpolated_linearly) {
    const std::vector<uint32_t> colors = {0x0000ff, 0x00ff00, 0xff8040, 0xffffff};  // blue, green, red from the upper byte down
    for (const Traversal traversal : support::traversals()) {
        const Image image = draw(painted_square(colors, reference::diffuse(reference::Vec3(0.5))), 4096, traversal).image;
        for (uint32_t y = 0; y < 16; y++)
            for (uint32_t x = 0; x < 16; x++) {
                // The middle of the pixel, from the lower left corner of the square. Both triangles lie on corner 0 and corner 2.
                const double u = (x + 0.5) / 16, v = 1 - (y + 0.5) / 16;
                const double weights[4] = {1 - std::max(u, v), u > v ? u - v : 0, std::min(u, v), u > v ? 0 : v - u};
                for (uint32_t k = 0; k < 3; k++) {
                    double expected = 0;
                    for (size_t corner = 0; corner < 4; corner++) expected += weights[corner] * linear_of_srgb(colors[corner] >> 8 * k & 255u);
                    // Noise, and the steps of colours in blocks.
                    EXPECT_NEAR(image.values[3 * (16 * y + x) + k], expected, 0.02 + 0.01 * expected) << x << ", " << y << ", channel " << k;
                }
            }
    }
}

// Where all corners of a mesh have one colour it is a material of that reflectance, but for the 10 bits that a channel has at a hit.
TEST(VertexColors, of_one_colour_are_that_of_a_material) {
    const uint32_t color = 0x3070d0;
    const auto reflectance = point_reflectance(point_color_code(color));
    const Scene plain = painted_square({}, reference::diffuse(reference::Vec3(reflectance[0], reflectance[1], reflectance[2])));
    const Scene painted = painted_square({color, color, color, color}, reference::diffuse(reference::Vec3(0.1)));
    const Image expected = draw(plain, 16, Traversal::automatic).image, found = draw(painted, 16, Traversal::automatic).image;
    for (size_t i = 0; i < expected.values.size(); i++) EXPECT_NEAR(found.values[i], expected.values[i], 1e-2 * expected.values[i]);
}

TEST(VertexColors, do_not_matter_where_they_are_not_wanted_or_the_material_is_not_diffuse) {
    const std::vector<uint32_t> colors = {0x0000ff, 0x00ff00, 0xff8040, 0xffffff};
    const auto mirror = reference::conductor({1, 1, 1}, {5, 4, 3}, 0.2);
    EXPECT_EQ(draw(painted_square(colors, mirror), 4, Traversal::automatic).report.film_hash,
              draw(painted_square({}, mirror), 4, Traversal::automatic).report.film_hash);
    const auto matt = reference::diffuse(reference::Vec3(0.5));
    Scene unwanted = painted_square(colors, matt);
    unwanted.shapes[0].vertex_colors = false;
    const uint64_t plain = draw(painted_square({}, matt), 4, Traversal::automatic).report.film_hash;
    EXPECT_EQ(draw(unwanted, 4, Traversal::automatic).report.film_hash, plain);
    EXPECT_NE(draw(painted_square(colors, matt), 4, Traversal::automatic).report.film_hash, plain);
}

}  // namespace
}  // namespace raypager
