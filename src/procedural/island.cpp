// A tropical island of instances: some hundred palms, trees, shrubs, stones and shells, placed as often as asked for between the sea and the
// tops of its mountains; and copies of the whole of it, as an archipelago. Units are metres; x east, y up, z south.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "procedural/island_images.hpp"
#include "procedural/island_land.hpp"
#include "procedural/island_layers.hpp"
#include "procedural/island_plan.hpp"
#include "procedural/island_plants.hpp"
#include "procedural/island_strand.hpp"
#include "procedural/kinds.hpp"
#include "procedural/plants.hpp"

namespace raypager {
namespace {

constexpr Vector towards_sun = {-0.72, 0.42, 0.30};
constexpr double open_sea_level = -0.3;  // below the water around islands, so that this hides where they meet
constexpr double horizon = 40'000;

// Waves of some lengths and headings, in metres, above and below 0.
double waves(double x, double z) {
    struct Wave {
        double east, south, length, height;
    };
    static constexpr Wave trains[] = {{0.28, 0.96, 19, 0.10},   {-0.45, 0.89, 11, 0.06}, {0.75, 0.66, 5.3, 0.035},
                                      {-0.83, 0.55, 2.9, 0.02}, {0.1, 0.99, 1.7, 0.012}, {0.9, -0.43, 1.1, 0.008}};
    double sum = 0;
    for (const Wave& wave : trains) {
        const double bend = 0.35 * sincos_turns((x * wave.south - z * wave.east) / (wave.length * 3.7)).sin;
        const double s = sincos_turns((x * wave.east + z * wave.south) / wave.length + bend).sin;
        sum += wave.height * (s + 0.25 * (s * s - 0.5));  // steeper crests than troughs
    }
    return sum;
}

class Island {
public:
    Island(const MakeSceneOptions& options, SceneWriter& scene)
        : options_(options), scene_(scene), plan_(options), land_(plan_.radius, plan_.ground_quads, options.seed) {}

    Status write() {
        begin();
        RAYPAGER_TRY(write_images());
        scene_.coat("open-water", open_water, 0.12);
        for (size_t i = 0; i < island_things; i++) RAYPAGER_TRY(write_objects(static_cast<IslandThing>(i)));
        const bool nested = options_.copies > 1;
        if (nested) scene_.begin_object("island");
        RAYPAGER_TRY(write_grid_mesh(scene_, "ground", "ground", land_.mesh()));
        RAYPAGER_TRY(write_grid_mesh(scene_, "water", "water", water()));
        RAYPAGER_TRY(write_island_layers(scene_, plan_, land_, options_.seed));
        if (nested) scene_.end_object();
        double reach = horizon;
        if (nested) RAYPAGER_TRY(place_copies(reach));
        RAYPAGER_TRY(write_open_sea(reach));
        scene_.count_instances(options_.instances * options_.copies + (nested ? options_.copies : 0));
        return {};
    }

private:
    Random random(IslandThing thing, uint64_t number) const { return Random(options_.seed, (static_cast<uint64_t>(thing) + 40) << 32 | number); }

    void begin() {
        const double distance = land_.eye()[2] + 0.12 * land_.radius();  // of the highest mountain
        scene_.begin(fmt::format("An island of {} instances and about {} triangles, in {} copies, seed {}; metres", options_.instances,
                                 options_.triangles, options_.copies, options_.seed),
                     {.eye = {0, 0, 0}, .target = {0, 0.15 * distance, -distance}, .fov_degrees = 40, .width = 1280, .height = 540});
        scene_.sun(towards_sun, {3.6, 2.9, 2.0});
    }

    // Files in textures/, and a texture for each.
    Status write_images() {
        const auto write = [&](std::string_view name, ImagePainter& painter) -> Status {
            const std::string file = fmt::format("textures/{}.{}", name, painter.channels() == 3 ? "ppm" : "pgm");
            const auto bytes = write_image_file(options_.directory / file, painter);
            if (!bytes) return bytes.status();
            scene_.count_images(1, uint64_t{painter.width()} * painter.height() * (painter.channels() == 3 ? 4 : 1), *bytes);
            if (painter.channels() == 3)
                scene_.color_texture(name, file);
            else
                scene_.number_texture(name, file);
            return {};
        };
        RAYPAGER_TRY(write("ground", *paint_ground(land_, plan_.image_size, options_.seed)));
        RAYPAGER_TRY(write("water", *paint_water(land_, plan_.image_size, options_.seed)));
        RAYPAGER_TRY(write("frond", *paint_frond_mask(256, 512)));
        RAYPAGER_TRY(write("petals", *paint_flower_mask(128)));
        scene_.textured_diffuse("ground", "ground");
        scene_.textured_coat("water", "water", "0.05");
        const std::filesystem::path sky = options_.directory / "textures/sky.pfm";
        RAYPAGER_TRY(write_image(sky, paint_sky(std::min(256u, plan_.image_size), unit(towards_sun), options_.seed)));
        std::error_code error;
        const uint64_t bytes = std::filesystem::file_size(sky, error);
        if (error) return Status::failed(fmt::format("{}: its size cannot be read: {}", sky.string(), error.message()));
        scene_.count_images(0, 0, bytes);
        scene_.image_sky("textures/sky.pfm");
        return {};
    }

    // The water around the island: choppy near the eye, calm on the beach and where its grid is too coarse for waves; its border dips under the
    // open sea.
    GridMesh water() const {
        const double half = land_.half();
        GridMesh grid{land_.axis_x().lines(plan_.water_quads), land_.axis_z().lines(plan_.water_quads), {}, land_.eye()};
        grid.height = [this, half, xs = grid.x, zs = grid.z](size_t column, size_t row) {
            const double px = xs[column], pz = zs[row];
            const size_t c = std::max<size_t>(column, 1), r = std::max<size_t>(row, 1);
            const double coarse = std::max(xs[c] - xs[c - 1], zs[r] - zs[r - 1]);
            const double border = smooth_step(0.85, 1, std::max(std::abs(px), std::abs(pz)) / half);
            const double chop = smooth_step(6, 1, coarse) * (0.12 + 0.88 * smooth_step(0, 25, -land_.inland(px, pz)));
            return waves(px, pz) * chop * (1 - border) + 2 * open_sea_level * border;
        };
        return grid;
    }

    // In triangles that are small where one looks from: large ones have no precision to spare for what is near.
    Status write_open_sea(double reach) {
        const std::vector<double> lines = WarpedAxis{-reach, reach, 0, 0.002}.lines(plan_.sea_quads);
        return write_grid_mesh(scene_, "open-sea", "open-water",
                               {lines, lines, [](size_t, size_t) { return open_sea_level; }, {0, land_.eye()[1], 0}});
    }

    Status write_objects(IslandThing thing) {
        const IslandKind& kind = plan_[thing];
        for (uint64_t i = 0; i < kind.kinds; i++) {
            Random own = random(thing, i);
            uint64_t triangles = kind.triangles;
            if (thing == IslandThing::tree) {
                const uint64_t later =
                    2 * (plan_.ground_quads * plan_.ground_quads + plan_.water_quads * plan_.water_quads + plan_.sea_quads * plan_.sea_quads);
                const uint64_t left = options_.triangles - std::min(options_.triangles, scene_.triangles() + later);
                triangles = std::max(left / (kind.kinds - i), min_tree_triangles);
            }
            const std::string name = fmt::format("{}-{:02}", kind.name, i);
            RAYPAGER_TRY(write_object(thing, name, triangles, own));
        }
        return {};
    }

    Status write_object(IslandThing thing, const std::string& name, uint64_t triangles, Random& own) {
        switch (thing) {
            case IslandThing::pebble:
            case IslandThing::boulder:
                return write_stone(name, make_rock(triangles, own), own);
            case IslandThing::shell:
                return write_pale(name, make_shell(triangles, own), {0.72, 0.58, 0.48}, own);
            case IslandThing::coral:
                return write_pale(name, make_coral(triangles, own), {0.74, 0.68, 0.60}, own);
            case IslandThing::driftwood:
                return write_pale(name, make_driftwood(triangles, own), {0.42, 0.36, 0.29}, own);
            case IslandThing::litter: {
                const double brown = own.uniform();
                scene_.diffuse(name, {0.20 + 0.16 * brown, 0.14 + 0.05 * brown, 0.06});
                return write_simple(name, make_fallen_leaf(own));
            }
            case IslandThing::tuft: {
                const double dry = own.uniform();
                scene_.diffuse_transmission(name, {0.11 + 0.12 * dry, 0.20, 0.045}, {0.07 + 0.06 * dry, 0.13, 0.02});
                return write_simple(name, grow_tuft(triangles, own));
            }
            case IslandThing::rosette: {
                const double blue = own.uniform();
                scene_.diffuse_transmission(name, {0.09, 0.17, 0.05 + 0.05 * blue}, {0.06, 0.12, 0.02});
                return write_simple(name, grow_rosette(triangles, own));
            }
            case IslandThing::fern:
                scene_.diffuse_transmission(name, {0.07, 0.17 + 0.05 * own.uniform(), 0.035}, {0.06, 0.14, 0.02});
                scene_.begin_object(name);
                RAYPAGER_TRY(scene_.textured_mesh(name, name, grow_fern(triangles, own), "frond"));
                scene_.end_object();
                return {};
            case IslandThing::hedge:
                return write_hedge(name, triangles, own);
            case IslandThing::palm:
                return write_palm(name, triangles, own);
            case IslandThing::tree:
                return write_tree(name, triangles, own);
        }
        return {};
    }

    Status write_simple(const std::string& name, const TriangleMesh& mesh) {
        scene_.begin_object(name);
        RAYPAGER_TRY(scene_.mesh(name, name, mesh.positions, mesh.triangles));
        scene_.end_object();
        return {};
    }

    Status write_stone(const std::string& name, const TriangleMesh& mesh, Random& own) {
        const double grey = own.uniform(0.14, 0.38), warm = own.uniform(0.02, 0.16);
        scene_.diffuse(name, {grey * (1 + warm), grey, grey * (1 - warm)});
        return write_simple(name, mesh);
    }

    Status write_pale(const std::string& name, const TriangleMesh& mesh, const Rgb& color, Random& own) {
        const double bright = own.uniform(0.8, 1.1), pink = own.uniform(0.85, 1);
        scene_.diffuse(name, {color[0] * bright, color[1] * bright * pink, color[2] * bright * pink});
        return write_simple(name, mesh);
    }

    Status write_two(const std::string& name, const std::string& first, const TriangleMesh& a, const std::string& second, const TriangleMesh& b,
                     std::string_view mask = {}) {
        scene_.begin_object(name);
        RAYPAGER_TRY(scene_.mesh(first, first, a.positions, a.triangles));
        if (mask.empty())
            RAYPAGER_TRY(scene_.mesh(second, second, b.positions, b.triangles));
        else
            RAYPAGER_TRY(scene_.textured_mesh(second, second, b, mask));
        scene_.end_object();
        return {};
    }

    Status write_hedge(const std::string& name, uint64_t triangles, Random& own) {
        constexpr Rgb colors[] = {{0.75, 0.05, 0.12}, {0.80, 0.12, 0.42}, {0.85, 0.42, 0.05}, {0.82, 0.74, 0.68}};
        const double light = own.uniform(0.8, 1.2);
        scene_.diffuse_transmission(name + "-leaf", {0.07 * light, 0.16 * light, 0.035}, {0.05 * light, 0.12 * light, 0.02});
        scene_.diffuse(name + "-flower", colors[own.below(std::size(colors))]);
        const Hedge hedge = grow_hedge(triangles, own);
        return write_two(name, name + "-leaf", hedge.leaves, name + "-flower", hedge.flowers, "petals");
    }

    Status write_palm(const std::string& name, uint64_t triangles, Random& own) {
        const double dark = own.uniform(0.8, 1.2), yellow = own.uniform();
        scene_.diffuse(name + "-bark", {0.26 * dark, 0.21 * dark, 0.16 * dark});
        scene_.diffuse_transmission(name + "-leaf", {0.09 + 0.09 * yellow, 0.19, 0.04}, {0.08 + 0.07 * yellow, 0.15, 0.02});
        const Palm palm = grow_palm(triangles, own);
        return write_two(name, name + "-bark", palm.wood, name + "-leaf", palm.leaves);
    }

    Status write_tree(const std::string& name, uint64_t triangles, Random& own) {
        const double bright = own.uniform(0.75, 1.25), yellow = own.uniform();
        scene_.diffuse(name + "-bark", {0.16, 0.12, 0.09});
        scene_.diffuse_transmission(name + "-leaf", {(0.05 + 0.07 * yellow) * bright, 0.16 * bright, 0.03 * bright},
                                    {(0.04 + 0.06 * yellow) * bright, 0.13 * bright, 0.015});
        const Tree tree = grow_tree(TreeHabit::broadleaf, triangles, own);
        return write_two(name, name + "-bark", tree.wood, name + "-leaf", tree.leaves);
    }

    // reach: becomes how far the sea has to go.
    Status place_copies(double& reach) {
        const Vector middle = land_.eye() * -1;  // of the island, in its own space
        std::string text;
        for (const IslandPlace& place : archipelago(options_.copies, 2 * std::sqrt(2.0) * land_.half(), options_.seed)) {
            Stance stance{{place.turn.cos, 0, -place.turn.sin}, {0, 1, 0}, {place.turn.sin, 0, place.turn.cos}, {}};
            const Vector turned = stance.x * middle[0] + stance.y * middle[1] + stance.z * middle[2];
            stance.origin = middle + Vector{place.x, 0, place.z} - turned;
            text += instance_line(stance, "island");
            reach = std::max(reach, std::max(std::abs(place.x), std::abs(place.z)) + horizon);
        }
        return scene_.include("instances/island.pbrt", text);
    }

    const MakeSceneOptions& options_;
    SceneWriter& scene_;
    const IslandPlan plan_;
    const IslandLand land_;
};

}  // namespace

Result<MadeScene> make_island(const MakeSceneOptions& options) {
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    RAYPAGER_TRY(Island(options, *scene).write());
    return scene->finish();
}

}  // namespace raypager
