// The Cornell box (Goral et al. 1984; dimensions as measured at Cornell, in millimetres) with three models of very many triangles in
// place of its blocks: the scene of the paper, section 4.1, with models of our own in the proportions of its three.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "procedural/kinds.hpp"
#include "procedural/noise.hpp"
#include "procedural/surface.hpp"

namespace raypager {
namespace {

constexpr double box_width = 556, box_height = 548.8, box_depth = 559.2;
constexpr uint64_t knot_share = 270, vase_share = 230, coral_share = 360, all_shares = knot_share + vase_share + coral_share;

void add_box(SceneWriter& scene) {
    scene.diffuse("white", {0.73, 0.71, 0.68});
    scene.diffuse("red", {0.57, 0.043, 0.044});
    scene.diffuse("green", {0.105, 0.378, 0.076});
    scene.diffuse("coral", {0.80, 0.42, 0.26});
    scene.diffuse("glaze", {0.16, 0.34, 0.62});
    scene.conductor("gold", {0.143, 0.375, 1.442}, {3.983, 2.386, 1.603}, 0.22);
    scene.conductor("mirror", {0.155, 0.117, 0.138}, {4.828, 3.122, 2.147}, 0);
    scene.glass("glass", 1.5);
    // Each seen from inside.
    scene.quad("white", {0, 0, 0}, {0, 0, box_depth}, {box_width, 0, 0});
    scene.quad("white", {0, box_height, 0}, {box_width, 0, 0}, {0, 0, box_depth});
    scene.quad("white", {0, 0, box_depth}, {0, box_height, 0}, {box_width, 0, 0});
    scene.quad("red", {box_width, 0, 0}, {0, 0, box_depth}, {0, box_height, 0});
    scene.quad("green", {0, 0, 0}, {0, box_height, 0}, {0, 0, box_depth});
    scene.light({213, box_height - 0.5, 227}, {130, 0, 0}, {0, 0, 105}, {34, 27, 17});
    scene.sphere("glass", {130, 52, 125}, 52);
    scene.sphere("mirror", {276, 40, 130}, 40);
}

// Grooves that meander as on a brain coral, on a lumpy ball.
Status add_coral(SceneWriter& scene, uint64_t triangles, uint64_t seed) {
    constexpr double radius = 118;
    const Vector center = {162, 108, 345};
    const auto n = static_cast<uint64_t>(std::max(1L, std::lround(std::sqrt(static_cast<double>(triangles) / 12))));
    const auto surface = [seed](const Vector& direction) {
        const Vector warp = {fractal_noise(direction * 2.1, 2, 0.5, seed), fractal_noise(direction * 2.1 + Vector{5, 1, 3}, 2, 0.5, seed + 11),
                             fractal_noise(direction * 2.1 + Vector{2, 8, 4}, 2, 0.5, seed + 22)};
        const double lumps = gradient_noise(direction * 1.7, seed + 33);
        const double grooves = 1 - std::abs(gradient_noise((direction + warp * 0.22) * 7.5, seed + 44)) * 2;
        const double grain = fractal_noise(direction * 60, 5, 0.6, seed + 55);
        return radius * (0.88 + 0.10 * lumps + 0.10 * smooth_step(-0.1, 0.95, grooves) + 0.006 * grain);
    };
    size_t face_number = 0;
    for (const SurfaceGrid& face : displaced_sphere(n, center, surface))
        RAYPAGER_TRY(write_surface(scene, fmt::format("coral-{}", face_number++), "coral", face));
    return {};
}

// A trefoil of rope.
Status add_knot(SceneWriter& scene, uint64_t triangles, uint64_t seed) {
    constexpr double length_to_girth = 9;
    TorusKnot knot;
    knot.center = {352, 175.5, 425};
    knot.major = 105;
    knot.minor = 46;
    knot.columns = std::max<uint64_t>(3, static_cast<uint64_t>(std::sqrt(static_cast<double>(triangles) / 2 / length_to_girth)));
    knot.rows = std::max<uint64_t>(3, triangles / 2 / knot.columns);
    knot.thickness = [seed](double along, double around) {
        // Strands wind a whole number of times, so that the ends meet.
        const double strand = sincos_turns(4 * around + 22 * along).sin;
        const double fibre = sincos_turns(44 * around + 310 * along).sin;
        const SinCos u = sincos_turns(along), v = sincos_turns(around);
        const double grain = fractal_noise({u.cos * 95, u.sin * 95 + v.cos * 14, v.sin * 14}, 4, 0.6, seed);
        return 29 + 4 * strand + 0.45 * fibre + 0.45 * grain;
    };
    return write_surface(scene, "knot", "gold", knot_surface(std::move(knot)));
}

// A vase with twisted flutes below and a hammered belt.
Status add_vase(SceneWriter& scene, uint64_t triangles, uint64_t seed) {
    Turned vase;
    vase.base = {430, 0.1, 170};
    vase.profile = {{0, 0},    {20, 0},     {40, 1},   {43, 8},   {40, 18},  {58, 52},  {68, 92}, {60, 132}, {36, 164}, {28, 186}, {34, 206},
                    {46, 214}, {44, 216.5}, {32, 207}, {24, 186}, {31, 164}, {55, 131}, {62, 92}, {52, 52},  {30, 20},  {12, 14},  {0, 13}};
    // A row of quads is about as high as wide: the profile is about twice as long as a typical circumference is.
    vase.columns = std::max<uint64_t>(3, static_cast<uint64_t>(std::sqrt(static_cast<double>(triangles) / 2 / 1.6)));
    vase.rows = std::max<uint64_t>(3, triangles / 2 / vase.columns + 1);
    vase.relief = [seed](double along, double around) {
        const double outside = smooth_step(0.15, 0.22, along) * smooth_step(0.50, 0.44, along);
        const double flutes = 1 - std::abs(sincos_turns(12 * around + 3 * along).sin);
        const SinCos v = sincos_turns(around);
        const double dents = gradient_noise({v.cos * 9, v.sin * 9, along * 40}, seed);
        const double grain = fractal_noise({v.cos * 50, v.sin * 50, along * 200}, 4, 0.6, seed + 7);
        return outside * (3.5 * flutes * flutes - 1.2 * std::max(0.0, dents) + 0.12 * grain);
    };
    return write_surface(scene, "vase", "glaze", turned_surface(std::move(vase)));
}

}  // namespace

Result<MadeScene> make_cornell(const MakeSceneOptions& options) {
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    scene->begin(fmt::format("Cornell box with about {} triangles, seed {}; millimetres", options.triangles, options.seed),
                 {.eye = {278, 273, -800}, .target = {278, 273, 0}, .fov_degrees = 39.3, .width = 1024, .height = 768});
    add_box(*scene);
    const uint64_t seed = mix_bits(options.seed);
    RAYPAGER_TRY(add_knot(*scene, options.triangles * knot_share / all_shares, seed));
    RAYPAGER_TRY(add_vase(*scene, options.triangles * vase_share / all_shares, seed + 1000));
    RAYPAGER_TRY(add_coral(*scene, options.triangles * coral_share / all_shares, seed + 2000));
    return scene->finish();
}

}  // namespace raypager
