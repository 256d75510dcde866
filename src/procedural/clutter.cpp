// A hall full of machine parts: very many small things of very uneven size and density, heaped so that their bounds overlap, with long
// thin pipes through everything. Made to be hard on anything that pages geometry by place. Metres; y up, the camera looks along -z.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "procedural/assemblies.hpp"
#include "procedural/kinds.hpp"
#include "procedural/scene_writer.hpp"

namespace raypager {
namespace {

constexpr double hall_width = 24, hall_height = 8, hall_depth = 18;  // x from -12 to 12, z from -18 to 0
constexpr uint64_t reference_triangles = 10'000'000;                 // at which detail is 1

// Meshes that grow, one for each kind of stuff, and go to a file when they are large.
class Batches {
public:
    Batches(SceneWriter& scene, uint64_t triangles_a_file) : scene_(scene), limit_(triangles_a_file) {}

    Status add(const Assembly& assembly) {
        for (size_t i = 0; i < stuff_count; i++) RAYPAGER_TRY(append(i, assembly.meshes[i]));
        triangles_ += assembly.triangles();
        return {};
    }
    Status flush() {
        for (size_t i = 0; i < stuff_count; i++) RAYPAGER_TRY(write(i));
        return {};
    }
    uint64_t triangles() const { return triangles_; }

private:
    Status append(size_t stuff, const TriangleMesh& mesh) {
        if (mesh.triangles.empty()) return {};
        TriangleMesh& batch = batches_.meshes[stuff];
        if (batch.triangles.size() + mesh.triangles.size() > limit_) RAYPAGER_TRY(write(stuff));
        const auto base = static_cast<uint32_t>(batch.positions.size());
        batch.positions.insert(batch.positions.end(), mesh.positions.begin(), mesh.positions.end());
        for (const Triangle& t : mesh.triangles) batch.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
        return {};
    }
    Status write(size_t stuff) {
        TriangleMesh& batch = batches_.meshes[stuff];
        if (batch.triangles.empty()) return {};
        RAYPAGER_TRY(
            scene_.mesh(fmt::format("{}-{:03}", stuff_names[stuff], written_[stuff]++), stuff_names[stuff], batch.positions, batch.triangles));
        batch.positions.clear();
        batch.triangles.clear();
        return {};
    }

    SceneWriter& scene_;
    uint64_t limit_, triangles_ = 0;
    Assembly batches_;
    std::array<uint32_t, stuff_count> written_{};
};

void add_materials(SceneWriter& scene) {
    scene.conductor("steel", {2.76, 2.54, 2.27}, {3.84, 3.43, 3.04}, 0.28);
    scene.conductor("iron", {2.87, 2.95, 2.65}, {3.05, 2.93, 2.77}, 0.45);
    scene.conductor("brass", {0.444, 0.527, 1.094}, {3.695, 2.765, 1.829}, 0.2);
    scene.conductor("copper", {0.2, 0.924, 1.102}, {3.912, 2.452, 2.142}, 0.25);
    scene.conductor("chrome", {3.18, 3.18, 2.33}, {3.31, 3.33, 3.04}, 0);
    scene.glass("glass", 1.5);
    scene.diffuse("red", {0.60, 0.07, 0.04});
    scene.diffuse("blue", {0.07, 0.20, 0.50});
    scene.diffuse("yellow", {0.78, 0.52, 0.05});
    scene.diffuse("white", {0.72, 0.72, 0.70});
    scene.diffuse("rubber", {0.05, 0.05, 0.055});
    scene.diffuse("floor", {0.30, 0.31, 0.32});
    scene.diffuse("wall", {0.52, 0.50, 0.46});
}

void add_hall(SceneWriter& scene) {
    const double x = hall_width / 2;
    scene.quad("floor", {-x, 0, -hall_depth}, {0, 0, hall_depth + 8}, {hall_width, 0, 0});
    scene.quad("wall", {-x, 0, -hall_depth}, {hall_width, 0, 0}, {0, hall_height, 0});
    scene.quad("wall", {-x, 0, 8}, {0, 0, -hall_depth - 8}, {0, hall_height, 0});
    scene.quad("wall", {x, 0, -hall_depth}, {0, 0, hall_depth + 8}, {0, hall_height, 0});
    scene.sky({0.16, 0.19, 0.24});
    for (int row = 0; row < 2; row++)
        for (int column = -1; column <= 1; column++)
            scene.light({7.5 * column - 1.5, hall_height + 0.5, -13 + 8.0 * row}, {3, 0, 0}, {0, 0, 1}, {44, 40, 33});
}

Pose lying(const Vector& origin, const Vector& direction) { return Pose::along(origin, direction); }

// Pipes along the back wall and beams under the open roof: what holds the picture together.
void add_fixtures(Assembly& assembly, double detail, Random& random) {
    for (int i = 0; i < 9; i++) {
        const double radius = 0.06 + 0.03 * random.below(5), y = 1.4 + 0.62 * i, z = -hall_depth + 0.5;
        for (int piece = 0; piece < 4; piece++) {
            const double left = -hall_width / 2 + hall_width / 4 * piece;
            add_pipe(assembly.of(i % 3 == 0   ? Stuff::copper
                                 : i % 3 == 1 ? Stuff::white
                                              : Stuff::steel),
                     lying({left, y, z}, {1, 0, 0}), radius, 0.2 * radius, hall_width / 4, segments_for(radius, detail));
            add_pipe(assembly.of(Stuff::red), lying({left, y, z}, {1, 0, 0}), 1.6 * radius, 0.55 * radius, 0.15, segments_for(radius, detail));
        }
    }
    for (int i = 0; i < 5; i++)
        add_beam(assembly.of(Stuff::yellow), lying({-hall_width / 2, hall_height - 0.6, -2.5 - 3.4 * i}, {1, 0, 0}), 0.14, 0.25, hall_width);
}

// From anywhere on one side of the hall to anywhere on the other, hardly thicker than a finger.
void add_diagonals(Assembly& assembly, uint64_t count, double detail, Random& random) {
    for (uint64_t i = 0; i < count; i++) {
        const Vector from = {-hall_width / 2 + 0.5, random.uniform(0.2, hall_height - 1), random.uniform(-hall_depth + 1, -2)};
        const Vector to = {hall_width / 2 - 0.5, random.uniform(0.2, hall_height - 1), random.uniform(-hall_depth + 1, -2)};
        const std::array<Vector, 2> path = {from, to};
        const double radius = random.uniform(0.004, 0.02);
        add_bar(assembly.of(random.below(2) == 0 ? Stuff::steel : Stuff::rubber), path, radius, segments_for(radius, 0.5 * detail));
    }
}

// Heaps: places where parts gather, the first ones much more than the last.
class Heaps {
public:
    explicit Heaps(Random& random) {
        for (uint32_t i = 0; i < count; i++) {
            heaps_[i] = {random.uniform(-hall_width / 2 + 2, hall_width / 2 - 2), random.uniform(-hall_depth + 2, -2.5), random.uniform(0.8, 3.2),
                         random.uniform(0.8, 4.5)};
            total_ += share(i);
        }
    }

    struct Spot {
        Vector at;
        double size;  // of what lies there
    };
    // Small things are many and lie deep in the heaps; large ones are few.
    Spot pick(Random& random) const {
        uint32_t i = 0;
        for (double left = random.uniform() * total_; i + 1 < count && left >= share(i); i++) left -= share(i);
        const Heap& heap = heaps_[i];
        const double u = random.uniform(), size = 0.08 + 1.1 * u * u * u * u * u * u;
        const double angle = random.uniform(), out = std::sqrt(random.uniform());
        const SinCos direction = sincos_turns(angle);
        const double x = heap.x + heap.radius * out * direction.cos * 1.4, z = heap.z + heap.radius * out * direction.sin;
        const double slope = 1 - out * out;
        const double most = heap.height * slope * random.uniform(), y = 0.2 * size + most * (0.3 + 0.7 * random.uniform());
        return {{std::clamp(x, -hall_width / 2 + 1, hall_width / 2 - 1), y, std::clamp(z, -hall_depth + 1.5, -1.5)}, size};
    }

private:
    static constexpr uint32_t count = 18;
    struct Heap {
        double x, z, radius, height;
    };
    static double share(uint32_t i) { return 1.0 / (1.5 + i); }
    std::array<Heap, count> heaps_{};
    double total_ = 0;
};

Pose any_pose(const Vector& at, Random& random) {
    // Most parts are aligned with the hall, as if just put down; the others lie as they fell.
    constexpr std::array<Vector, 3> axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    // One draw a statement, here and wherever random numbers are arguments: compilers differ in the order in which they evaluate those.
    if (random.below(5) < 2) {
        const double turn = 0.25 * random.below(4);
        return Pose::along(at, axes[random.below(3)], turn);
    }
    const double turn = random.uniform();
    return Pose::along(at, random.direction(), turn);
}

// Until the wanted number of triangles is reached within one percent.
Status add_heaps(Batches& batches, uint64_t wanted, double detail, Random& random) {
    const Heaps heaps(random);
    Assembly assembly;
    int refused = 0;
    while (batches.triangles() + wanted / 100 < wanted && refused < 1000) {
        const Heaps::Spot spot = heaps.pick(random);
        assembly.clear();
        add_random_assembly(assembly, any_pose(spot.at, random), spot.size, detail, random);
        if (batches.triangles() + assembly.triangles() > wanted + wanted / 100) {
            refused++;
            continue;
        }
        RAYPAGER_TRY(batches.add(assembly));
    }
    return {};
}

// Finer parts as well as more parts with more triangles: the fourth root of their number.
double detail_for(uint64_t triangles) {
    return std::clamp(std::sqrt(std::sqrt(static_cast<double>(triangles) / static_cast<double>(reference_triangles))), 0.1, 4.0);
}

}  // namespace

Result<MadeScene> make_clutter(const MakeSceneOptions& options) {
    auto scene = SceneWriter::create(options);
    if (!scene) return scene.status();
    scene->begin(fmt::format("A hall full of about {} triangles of machine parts, seed {}; metres", options.triangles, options.seed),
                 {.eye = {-2, 4.4, 5.5}, .target = {0.2, 1.7, -8}, .fov_degrees = 46});
    add_materials(*scene);
    add_hall(*scene);

    Random random(options.seed, 1);
    const double detail = detail_for(options.triangles);
    Batches batches(*scene, std::clamp<uint64_t>(options.triangles / 150, 50'000, max_mesh_triangles));
    const uint64_t rest = options.triangles - std::min(options.triangles, scene->triangles());
    Assembly fixtures;
    if (rest >= 100'000) add_fixtures(fixtures, detail, random);
    add_diagonals(fixtures, std::min<uint64_t>(40, rest / 500), detail, random);
    RAYPAGER_TRY(batches.add(fixtures));
    RAYPAGER_TRY(add_heaps(batches, rest, detail, random));
    RAYPAGER_TRY(batches.flush());
    return scene->finish();
}

}  // namespace raypager
