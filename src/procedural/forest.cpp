// A forest of instances: a few dozen trees, rocks and tufts of grass, placed as often as asked for on hilly ground. Units are metres; x east, y up,
// z south.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "procedural/height_field.hpp"
#include "procedural/kinds.hpp"
#include "procedural/layers.hpp"
#include "procedural/noise.hpp"
#include "procedural/plants.hpp"

namespace raypager {
namespace {

constexpr double metres_a_tree = 4.6;   // on average, from one to the next
constexpr double smallest_forest = 50;  // along a side
constexpr double finest_ground = 0.2;   // from one vertex to the next

enum Soil : uint8_t { turf, litter, gravel };
const std::vector<std::string_view> soil_names = {"turf", "litter", "gravel"};

// How the triangles and the instances are spent.
struct ForestPlan {
    uint64_t ground_triangles, trees, tree_triangles, tufts, tuft_triangles, rocks, rock_triangles;  // kinds, and what each may take
    uint64_t placed_trees, placed_tufts, placed_rocks;
    double side;  // of the land

    explicit ForestPlan(const MakeSceneOptions& options) {
        const uint64_t n = options.instances, all = options.triangles;
        placed_rocks = n / 16;
        placed_tufts = n * 9 / 16;
        placed_trees = n - placed_rocks - placed_tufts;
        side = std::max(smallest_forest, metres_a_tree * std::sqrt(static_cast<double>(placed_trees)));
        const double finest = side / finest_ground;
        ground_triangles = std::min(all / 4, static_cast<uint64_t>(2 * finest * finest));
        rocks = std::clamp<uint64_t>(all / 10'000, 1, 6);
        rock_triangles = all / 25 / rocks;
        tufts = std::clamp<uint64_t>(all / 10'000, 1, 6);
        tuft_triangles = all / 20 / tufts;
        trees = std::clamp<uint64_t>(all / 1500, 1, 36);
        tree_triangles = 0;  // what the rest leaves
    }
};

class Land {
public:
    Land(const ForestPlan& plan, uint64_t seed) : side_(plan.side), seed_(mix_bits(seed)) {
        field_.columns = std::max<uint64_t>(4, static_cast<uint64_t>(std::sqrt(static_cast<double>(plan.ground_triangles) / 2)));
        field_.rows = std::max<uint64_t>(4, plan.ground_triangles / 2 / field_.columns);
        field_.spacing_x = side_ / static_cast<double>(field_.columns);
        field_.spacing_z = side_ / static_cast<double>(field_.rows);
        field_.height = [this](double column, double row) { return height(column * field_.spacing_x, row * field_.spacing_z); };
    }
    Land(const Land&) = delete;  // the field's heights are those of this one
    Land& operator=(const Land&) = delete;

    const HeightField& field() const { return field_; }
    double side() const { return side_; }

    // Of the triangles that the ground is made of, so that nothing hangs in the air however coarse they are.
    double ground(double x, double z) const {
        const double column = std::clamp(x / field_.spacing_x, 0.0, static_cast<double>(field_.columns)),
                     row = std::clamp(z / field_.spacing_z, 0.0, static_cast<double>(field_.rows));
        const double c = std::min(std::floor(column), static_cast<double>(field_.columns - 1)),
                     r = std::min(std::floor(row), static_cast<double>(field_.rows - 1));
        const double u = column - c, v = row - r;
        const double b = field_.height(c + 1, r), d = field_.height(c, r + 1);
        if (u + v <= 1) {
            const double a = field_.height(c, r);
            return a + (b - a) * u + (d - a) * v;
        }
        const double e = field_.height(c + 1, r + 1);
        return e + (d - e) * (1 - u) + (b - e) * (1 - v);
    }
    Vector normal(double x, double z) const {
        const double step = 0.5 * (field_.spacing_x + field_.spacing_z);
        return unit({ground(x - step, z) - ground(x + step, z), 2 * step, ground(x, z - step) - ground(x, z + step)});
    }

    // 1 in the woods, 0 in clearings.
    double woods(double x, double z) const {
        const double wave = std::clamp(side_ / 3, 25.0, 110.0);
        return smooth_step(-0.22, 0.08, fractal_noise({x / wave, 0.3, z / wave}, 3, 0.5, seed_ + 31));
    }
    // About -1 to 1: which trees stand together.
    double stand(double x, double z) const {
        const double wave = std::clamp(side_ / 2, 30.0, 260.0);
        return fractal_noise({x / wave, 0.7, z / wave}, 3, 0.5, seed_ + 61) + 0.7 * (0.5 - z / side_);
    }
    // 0 around the camera, 1 further away.
    double away(double x, double z) const {
        const double reach = std::clamp(0.3 * side_, 14.0, 75.0), dx = x - eye_x(), dz = (z - eye_z()) * 0.75;
        return smooth_step(0.45 * reach, reach, std::sqrt(dx * dx + dz * dz));
    }
    double eye_x() const { return 0.5 * side_; }
    double eye_z() const { return 0.93 * side_; }
    // The world's origin is there, where what is seen is small: single precision has the most digits near it.
    Vector eye() const { return {eye_x(), 0, eye_z()}; }

private:
    // Hills to the north and a little aside, a knoll from which one looks, and all of it uneven.
    double height(double x, double z) const {
        const double u = x / side_, v = z / side_;
        const double high = std::min(0.13 * side_, 420.0), wave = std::clamp(side_ / 3, 20.0, 520.0);
        const double aside = std::abs(u - 0.5) * 2;
        const double range = 0.9 * smooth_step(0.62, 0.02, v) + 0.35 * smooth_step(0.35, 1, aside) * smooth_step(0.9, 0.5, v);
        const double rough = fractal_noise({x / wave, 0.5, z / wave}, 6, 0.46, seed_ + 1);
        const double dx = (x - eye_x()) / (0.16 * side_), dz = (z - eye_z()) / (0.12 * side_);
        const double knoll = smooth_step(1, 0, dx * dx + dz * dz) * std::min(0.035 * side_, 28.0);
        return high * range * (0.8 + 0.5 * rough) + 0.075 * wave * rough + knoll;
    }

    double side_;
    uint64_t seed_;
    HeightField field_;
};

class Forest {
public:
    Forest(const MakeSceneOptions& options, SceneWriter& scene) : options_(options), scene_(scene), plan_(options), land_(plan_, options.seed) {}

    Status write() {
        begin();
        RAYPAGER_TRY(write_ground());
        RAYPAGER_TRY(write_rocks());
        RAYPAGER_TRY(write_tufts());
        RAYPAGER_TRY(write_trees());
        RAYPAGER_TRY(place_rocks());
        RAYPAGER_TRY(place_tufts());
        RAYPAGER_TRY(place_trees());
        scene_.count_instances(options_.instances);
        return {};
    }

private:
    Random random(uint64_t kind, uint64_t number) const { return Random(options_.seed, kind << 32 | number); }

    void begin() {
        const double x = land_.eye_x(), z = land_.eye_z();
        double eye = 0;  // above all that is near
        for (int i = -4; i <= 4; i++)
            for (int j = -4; j <= 0; j++) eye = std::max(eye, land_.ground(x + i, z + j));
        eye += std::clamp(0.02 * land_.side(), 2.2, 7.0);
        const double ahead = z - 0.5 * land_.side(), target = 0.4 * eye + 0.6 * land_.ground(x, ahead);
        scene_.begin(
            fmt::format("A forest of {} instances and about {} triangles, seed {}; metres", options_.instances, options_.triangles, options_.seed),
            {.eye = {0, eye, 0}, .target = {0, target, ahead - z}, .fov_degrees = 48});
        scene_.diffuse("turf", {0.12, 0.17, 0.05});
        scene_.diffuse("litter", {0.13, 0.10, 0.06});
        scene_.diffuse("gravel", {0.27, 0.25, 0.23});
        scene_.sky({0.42, 0.56, 0.80});
        scene_.sun({-0.75, 0.60, -0.10}, {3.4, 2.95, 2.3});
    }

    Status write_ground() {
        scene_.begin_moved(land_.eye() * -1);
        RAYPAGER_TRY(write_height_field(scene_, land_.field(), soil_names, [&](double x, double, double z, double upness) -> uint8_t {
            const double wander = 0.2 * value_noise(x / 3, z / 3, options_.seed + 5).value;
            if (upness < 0.72 + 0.2 * wander) return gravel;
            return land_.woods(x, z) * land_.away(x, z) > 0.45 + wander ? litter : turf;
        }));
        scene_.end_moved();
        return {};
    }

    Status write_rocks() {
        for (uint64_t i = 0; i < plan_.rocks; i++) {
            Random own = random(1, i);
            const TriangleMesh rock = make_rock(plan_.rock_triangles, own);
            const std::string name = fmt::format("rock-{:02}", i);
            const double grey = own.uniform(0.2, 0.36);
            scene_.diffuse(name, {grey * 1.04, grey, grey * 0.94});
            scene_.begin_object(name);
            RAYPAGER_TRY(scene_.mesh(name, name, rock.positions, rock.triangles));
            scene_.end_object();
        }
        return {};
    }

    Status write_tufts() {
        for (uint64_t i = 0; i < plan_.tufts; i++) {
            Random own = random(2, i);
            const TriangleMesh tuft = grow_tuft(plan_.tuft_triangles, own);
            const std::string name = fmt::format("tuft-{:02}", i);
            const double dry = own.uniform();
            scene_.diffuse_transmission(name, {0.10 + 0.10 * dry, 0.19 - 0.02 * dry, 0.04}, {0.06 + 0.05 * dry, 0.12, 0.02});
            scene_.begin_object(name);
            RAYPAGER_TRY(scene_.mesh(name, name, tuft.positions, tuft.triangles));
            scene_.end_object();
        }
        return {};
    }

    uint64_t conifers() const { return plan_.trees / 2; }  // the first of the trees

    // They take the triangles that are left.
    Status write_trees() {
        for (uint64_t i = 0; i < plan_.trees; i++) {
            Random own = random(3, i);
            const uint64_t left = options_.triangles - std::min(options_.triangles, scene_.triangles());
            const Tree tree =
                grow_tree(i < conifers() ? TreeHabit::conifer : TreeHabit::broadleaf, std::max(left / (plan_.trees - i), min_tree_triangles), own);
            const std::string name = fmt::format("tree-{:02}", i), bark = name + "-bark", leaf = name + "-leaf";
            add_tree_materials(i < conifers(), bark, leaf, own);
            scene_.begin_object(name);
            RAYPAGER_TRY(scene_.mesh(bark, bark, tree.wood.positions, tree.wood.triangles));
            RAYPAGER_TRY(scene_.mesh(leaf, leaf, tree.leaves.positions, tree.leaves.triangles));
            scene_.end_object();
        }
        return {};
    }

    void add_tree_materials(bool conifer, const std::string& bark, const std::string& leaf, Random& own) {
        const double dark = own.uniform(0.7, 1.2), yellow = own.uniform(), bright = own.uniform(0.8, 1.2);
        scene_.diffuse(bark, {0.19 * dark, 0.14 * dark, 0.10 * dark});
        if (conifer)
            scene_.diffuse_transmission(leaf, {0.05 * bright, (0.115 - 0.02 * yellow) * bright, 0.04 * bright}, {0.02, 0.045 * bright, 0.012});
        else
            scene_.diffuse_transmission(leaf, {(0.075 + 0.10 * yellow) * bright, (0.19 - 0.02 * yellow) * bright, 0.035 * bright},
                                        {(0.06 + 0.08 * yellow) * bright, 0.16 * bright, 0.02});
    }

    Status place_rocks() {
        Layer layer{"rock", plan_.rocks, plan_.placed_rocks, {}, {}};
        layer.density = [&](double x, double z) { return 0.08 + smooth_step(0.2, 0.55, value_noise(x / 17, z / 17, options_.seed + 71).value); };
        layer.place = [&](double x, double z, Random& own) {
            const double u = own.uniform(), v = own.uniform(), w = own.uniform(), size = u * v * w * 2.6 + 0.25;
            const Vector at = {x, land_.ground(x, z) + 0.1 * size, z};
            const Stance stance = turned_stance(at, unit(land_.normal(x, z) + own.direction() * 0.35), own);
            const double height = size * own.uniform(0.8, 1.2);
            return std::pair<uint64_t, Stance>(own.below(static_cast<uint32_t>(plan_.rocks)), scaled(stance, size, height));
        };
        return write_layer(scene_, layer, {land_.side(), land_.eye()}, options_.seed);
    }

    Status place_tufts() {
        Layer layer{"tuft", plan_.tufts, plan_.placed_tufts, {}, {}};
        layer.density = [&](double x, double z) {
            const double patchy = smooth_step(-0.7, 0.4, value_noise(x / 6, z / 6, options_.seed + 81).value);
            return (0.1 + patchy) * (1.15 - land_.woods(x, z) * land_.away(x, z)) * (1 + 5 * (1 - land_.away(x, z)));
        };
        layer.place = [&](double x, double z, Random& own) {
            const double size = own.uniform(0.7, 1.4);
            Stance stance = turned_stance({x, land_.ground(x, z), z}, land_.normal(x, z), own);
            if (own.below(2) == 0) stance.x = stance.x * -1;
            const double height = size * own.uniform(0.7, 1.3);
            return std::pair<uint64_t, Stance>(own.below(static_cast<uint32_t>(plan_.tufts)), scaled(stance, size, height));
        };
        return write_layer(scene_, layer, {land_.side(), land_.eye()}, options_.seed);
    }

    Status place_trees() {
        Layer layer{"tree", plan_.trees, plan_.placed_trees, {}, {}};
        layer.density = [&](double x, double z) { return (0.012 + land_.woods(x, z)) * (0.002 + land_.away(x, z)); };
        layer.place = [&](double x, double z, Random& own) {
            const double wish = land_.stand(x, z) + own.uniform(-0.35, 0.35);
            const bool conifer = conifers() > 0 && wish > 0;
            const uint64_t first = conifer ? 0 : conifers(), kinds = conifer ? conifers() : plan_.trees - conifers();
            const uint64_t kind = first + own.below(static_cast<uint32_t>(kinds));
            const double size = own.below(6) == 0 ? own.uniform(0.25, 0.6) : own.uniform(0.7, 1.2);
            const Vector up = unit(Vector{0, 1, 0} + own.direction() * 0.05);
            Stance stance = turned_stance({x, land_.ground(x, z), z}, up, own);
            if (own.below(3) == 0) stance.x = stance.x * -1;  // mirrored
            return std::pair<uint64_t, Stance>(kind, scaled(stance, size, size * own.uniform(0.9, 1.15)));
        };
        return write_layer(scene_, layer, {land_.side(), land_.eye()}, options_.seed);
    }

    const MakeSceneOptions& options_;
    SceneWriter& scene_;
    const ForestPlan plan_;
    const Land land_;
};

}  // namespace

Result<MadeScene> make_forest(const MakeSceneOptions& options) {
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    RAYPAGER_TRY(Forest(options, *scene).write());
    return scene->finish();
}

}  // namespace raypager
