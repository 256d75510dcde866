// Landscapes: fractal mountains about a lake, or the relief of an elevation image. Units are metres; x east, y up, z south.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "procedural/height_field.hpp"
#include "procedural/heightmap.hpp"
#include "procedural/kinds.hpp"
#include "procedural/noise.hpp"

namespace raypager {
namespace {

constexpr double landscape_size = 16000;
constexpr double peak_height = 2600;
constexpr double lake_level = 250;

enum Ground : uint8_t { meadow, scree, rock, snow, water };
const std::vector<std::string_view> ground_names = {"meadow", "scree", "rock", "snow", "water"};

// Ridged multifractal over a warped plane (Musgrave, in Ebert et al., Texturing and Modeling, ch. 16): each octave is weighted by the
// one before, so that ridges are rough and valleys smooth.
class FractalLandscape {
public:
    FractalLandscape(double spacing, uint64_t seed) : seed_(mix_bits(seed)) {
        // Down to waves of about two grid steps.
        for (double wave = first_wave; wave > 2 * spacing && octaves_ < 16; wave /= 2) octaves_++;
    }

    double height(double x, double z) const {
        const double u = x / landscape_size, v = z / landscape_size;
        const double px = x / first_wave, pz = z / first_wave;
        const Vector warp_at = {px * 0.7, 0.5, pz * 0.7};
        const double wx = px + 0.35 * fractal_noise(warp_at, 3, 0.45, seed_ + 101);
        const double wz = pz + 0.35 * fractal_noise(warp_at, 3, 0.45, seed_ + 111);
        // A basin, a range behind it and at the sides, and hills in front.
        const double aside = std::abs(u - 0.5) * 2;
        const double range = 0.22 + 0.83 * smooth_step(0.75, 0.15, v) + 0.40 * smooth_step(0.25, 1, aside) + 0.25 * smooth_step(0.78, 1, v);
        return peak_height * (std::min(range, 1.05) * ridges({wx, 0, wz}) -
                              0.05 * smooth_step(0.35, 0.6, v) * smooth_step(0.95, 0.7, v) * smooth_step(1, 0.2, aside));
    }

private:
    static constexpr double first_wave = 5200;

    double ridges(Vector p) const {
        double sum = 0, amplitude = 0.55, weight = 1;
        for (int octave = 0; octave < octaves_; octave++) {
            const double fold = 1 - 1.25 * std::abs(gradient_noise(p, seed_ + static_cast<uint64_t>(octave)));
            const double ridge = fold * fold * weight;
            sum += amplitude * ridge;
            weight = std::clamp(1.7 * ridge, 0.0, 1.0);
            amplitude *= 0.48;
            // A rotation (3-4-5) with scaling, so that the lattices of the octaves do not line up.
            p = {2.04 * (0.8 * p[0] - 0.6 * p[2]) + 11.3, p[1] + 0.37, 2.04 * (0.6 * p[0] + 0.8 * p[2]) + 7.1};
        }
        return sum;
    }

    uint64_t seed_;
    int octaves_ = 1;
};

// Snow on high gentle ground (from snow_line, a share of the range, on), rock where it is steep, meadow low; the borders wander.
Ground ground_at(double x, double y, double z, double upness, const HeightRange& range, double snow_line, uint64_t seed) {
    const double wander = value_noise(x / 400, z / 400, seed + 201).value + 0.5 * value_noise(x / 90, z / 90, seed + 202).value;
    const double level = (y - range.low) / std::max(range.high - range.low, 1e-9) + 0.05 * wander;
    if (level > snow_line && upness > 0.80 - 0.55 * (level - snow_line) + 0.04 * wander) return snow;
    if (upness < 0.74 + 0.03 * wander) return rock;
    if (level < snow_line - 0.1 && upness > 0.84 + 0.03 * wander) return meadow;
    return scree;
}

void add_materials_and_light(SceneWriter& scene) {
    scene.diffuse("meadow", {0.14, 0.19, 0.06});
    scene.diffuse("scree", {0.30, 0.25, 0.19});
    scene.diffuse("rock", {0.23, 0.20, 0.18});
    scene.diffuse("snow", {0.82, 0.84, 0.88});
    scene.diffuse("water", {0.03, 0.07, 0.11});
    scene.sky({0.36, 0.52, 0.80});
    scene.sun({-0.72, 0.50, 0.28}, {2.9, 2.45, 1.85});
}

// Nothing within reach is higher than the eye.
double eye_height(const HeightField& field, double x, double z, double reach) {
    double highest = field.height_at(x, z);
    for (int i = -8; i <= 8; i++)
        for (int j = -8; j <= 8; j++)
            highest = std::max(highest,
                               field.height_at(std::clamp(x + reach * i / 8, 0.0, field.width()), std::clamp(z + reach * j / 8, 0.0, field.depth())));
    return highest;
}

Result<MadeScene> make_fractal(const MakeSceneOptions& options) {
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    HeightField field;
    field.columns = std::max<uint64_t>(1, static_cast<uint64_t>(std::sqrt(static_cast<double>(options.triangles) / 2)));
    field.rows = std::max<uint64_t>(1, options.triangles / 2 / field.columns);
    field.spacing_x = landscape_size / static_cast<double>(field.columns);
    field.spacing_z = landscape_size / static_cast<double>(field.rows);
    const FractalLandscape landscape(field.spacing_x, options.seed);
    field.height = [&](double column, double row) { return landscape.height(column * field.spacing_x, row * field.spacing_z); };

    const double x = 0.47 * landscape_size, z = 0.985 * landscape_size;
    const double eye = std::max(eye_height(field, x, z, 0.06 * landscape_size), lake_level) + 700;
    scene->begin(fmt::format("Fractal landscape of about {} triangles, seed {}; metres", options.triangles, options.seed),
                 {.eye = {x, eye, z}, .target = {0.52 * landscape_size, 0.30 * eye, 0.42 * landscape_size}, .fov_degrees = 42});
    add_materials_and_light(*scene);
    const HeightRange range = height_range(field);
    RAYPAGER_TRY(write_height_field(*scene, field, ground_names, [&](double px, double py, double pz, double upness) {
        return ground_at(px, py, pz, upness, range, 0.40, options.seed);
    }));
    // A lake: a sheet of water that lets the light of the sky in.
    scene->glass("lake", 1.33);
    scene->quad("lake", {0, lake_level, 0}, {0, 0, landscape_size}, {landscape_size, 0, 0});
    return scene->finish();
}

double mean_height(const HeightField& field, double z_low, double z_high) {
    double sum = 0;
    for (int i = 0; i <= 20; i++)
        for (int j = 0; j <= 20; j++) sum += field.height_at(field.width() * (0.2 + 0.03 * i), z_low + (z_high - z_low) * 0.05 * j);
    return sum / (21 * 21);
}

// How far down the map to stand, looking north: where the ground ahead rises most above the ground here.
double standpoint(const HeightField& field) {
    double best = field.depth(), most = -INFINITY;
    for (double share = 0.98; share > 0.45; share -= 0.02) {
        const double z = share * field.depth(), unit = field.depth();
        const double rise =
            mean_height(field, z - 0.30 * unit, z - 0.08 * unit) - mean_height(field, z - 0.08 * unit, std::min(unit, z + 0.04 * unit));
        if (rise <= most) continue;
        most = rise;
        best = z;
    }
    return best;
}

Result<MadeScene> make_from_heightmap(const MakeSceneOptions& options) {
    auto map = read_heightmap(*options.heightmap);
    if (!map) return map.status();
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    const HeightField field = field_of(*map, options.triangles);
    const HeightRange range = height_range(field, 400);
    const double x = 0.5 * field.width(), z = standpoint(field);
    const double size = std::min(field.width(), field.depth());
    const double eye = eye_height(field, x, z, 0.03 * size) + 0.05 * size;
    scene->begin(fmt::format("Relief from {}; metres", options.heightmap->filename().string()),
                 {.eye = {x, eye, z}, .target = {x, range.low, z - 0.36 * size}, .fov_degrees = 28});
    add_materials_and_light(*scene);
    RAYPAGER_TRY(write_height_field(*scene, field, ground_names, [&](double px, double py, double pz, double upness) -> uint8_t {
        if (py <= 0.5 && upness >= 0.999999) return water;  // the sea is exactly flat in elevation models
        return ground_at(px, py, pz, upness, range, 0.55, options.seed);
    }));
    return scene->finish();
}

}  // namespace

Result<MadeScene> make_terrain(const MakeSceneOptions& options) { return options.heightmap ? make_from_heightmap(options) : make_fractal(options); }

}  // namespace raypager
