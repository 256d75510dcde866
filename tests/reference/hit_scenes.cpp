// The scenes that are hard to intersect or to page.
#include <fmt/format.h>

#include "reference/scene_builder.hpp"

namespace raypager::reference {
namespace {

// Value noise from a hash of the lattice, smooth between its points.
double lattice_value(int x, int y) {
    uint64_t h = static_cast<uint32_t>(x) * 0x9e3779b97f4a7c15ull + static_cast<uint32_t>(y) * 0xc2b2ae3d27d4eb4full;
    h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9ull;
    return static_cast<double>((h ^ (h >> 32)) >> 40) * 0x1p-24;
}

double noise(double x, double y) {
    const double cx = std::floor(x), cy = std::floor(y), fx = x - cx, fy = y - cy;
    const int ix = static_cast<int>(cx), iy = static_cast<int>(cy);
    const double sx = fx * fx * (3 - 2 * fx), sy = fy * fy * (3 - 2 * fy);
    const double bottom = std::lerp(lattice_value(ix, iy), lattice_value(ix + 1, iy), sx);
    const double top = std::lerp(lattice_value(ix, iy + 1), lattice_value(ix + 1, iy + 1), sx);
    return std::lerp(bottom, top, sy);
}

double terrain_height(double s, double t) {
    double height = 0, weight = 1.2, frequency = 4;
    for (int octave = 0; octave < 7; octave++, weight *= 0.5, frequency *= 2) height += weight * (noise(s * frequency, t * frequency) - 0.5);
    return height;
}

// A sixteenth of a power of two times 16 to 31: what the radius code of a point holds, for it has three bits behind the leading one.
float storable_radius(Dice& dice, int smallest, int largest) {
    const int exponent = smallest + static_cast<int>(dice.below(static_cast<uint32_t>(largest - smallest + 1)));
    return std::ldexp(1 + static_cast<float>(dice.below(8)) / 8, exponent);
}

std::vector<CloudPoint> hills_of_points(Dice& dice, uint32_t count) {
    std::vector<CloudPoint> points;
    for (uint32_t i = 0; i < count; i++) {
        const double s = dice.between(0, 1), t = dice.between(0, 1), above = dice.below(10) == 0 ? dice.between(0, 1) : 0.0;
        const Vec3 p(10 * (s - 0.5), 10 * (t - 0.5), terrain_height(s, t) + above);
        const uint32_t color = static_cast<uint32_t>(dice.below(1u << 24));
        points.push_back({p.to_float(), dice.below(50) == 0 ? storable_radius(dice, -3, -2) : storable_radius(dice, -8, -4), color});
    }
    // The same point twice, and one inside of another: the first, and the outer, are hit.
    points.push_back(points[0]);
    points.push_back({points[1].position, points[1].radius / 2, 0x00ff00});
    return points;
}

Transform placed(Dice& dice, const Vec3& position, double size) {
    const Vec3 axis = dice.point(-1, 1);
    const double degrees = dice.between(0, 360), stretch = dice.between(0.5, 2), mirrored = dice.below(4) == 0 ? -1 : 1;
    return Transform::translate(position.x, position.y, position.z) * Transform::rotate(degrees, axis.x, axis.y, axis.z) *
           Transform::scale(mirrored * size, size * stretch, size);
}

// Half of the parts crowd around a few places, the others lie anywhere in [-4, 4]^3 above the ground.
Vec3 part_position(Dice& dice) {
    const Vec3 anywhere(dice.between(-4, 4), dice.between(0.2, 4), dice.between(-4, 4));
    if (dice.below(2)) return anywhere;
    const Vec3 crowds[] = {{-1.5, 0.6, 1}, {1.8, 0.4, 1.6}, {0.3, 1.6, -1}};
    return crowds[dice.below(3)] + dice.point(-1, 1) * dice.between(0.05, 0.6);
}

}  // namespace

Scene terrain_small(uint32_t n, bool smooth_normals, PictureSize size) {
    SceneBuilder scene(size);
    TriangleMesh mesh = patch(n, n, [](double s, double t) { return Vec3(10 * (s - 0.5), 10 * (t - 0.5), terrain_height(s, t)); });
    if (smooth_normals) add_normals(mesh);
    scene.add("terrain", std::move(mesh), scene.material(diffuse({0.45, 0.4, 0.3})));
    scene.camera({0, -5.5, 2.6}, {0, 0, -0.2}, {0, 0, 1}, 45);
    scene.infinite_light({0.35, 0.45, 0.65});
    scene.distant_light({0.5, 0.25, 0.6}, {2.6, 2.3, 1.9});
    return scene.finish();
}

Scene clutter_small(uint32_t parts, uint64_t seed, PictureSize size) {
    SceneBuilder scene(size);
    Dice dice(seed);
    const uint32_t ground = scene.material(diffuse(Vec3(0.5)));
    const uint32_t materials[] = {scene.material(diffuse({0.7, 0.3, 0.2})),
                                  scene.material(diffuse({0.2, 0.4, 0.7})),
                                  scene.material(conductor({1.3, 1.0, 0.7}, {7.5, 6.4, 5.3}, 0.2)),
                                  scene.material(conductor({0.2, 0.4, 1.4}, {3.6, 2.6, 1.8}, 0)),
                                  scene.material(glass(1.5)),
                                  scene.material(diffuse(Vec3(0.75)))};
    const uint32_t black = scene.material(absorber());
    scene.camera({0.5, 4, 9}, {0, 1.3, 0}, {0, 1, 0}, 45);
    scene.add("ground", quad({-12, 0, 12}, {24, 0, 0}, {0, 0, -24}, 16), ground);
    for (uint32_t i = 0; i < parts; i++) {
        const double part_size = 0.5 * std::exp2(dice.between(-5, 0));
        const Vec3 position = part_position(dice);
        const uint32_t material = materials[dice.below(6)], kind = dice.below(4);
        const std::string name = fmt::format("part {}", i);
        if (kind == 0) {
            scene.add(name, box(Vec3(-1), Vec3(1), 1 + dice.below(3)), material, placed(dice, position, part_size));
        } else if (kind == 1) {
            scene.add(name, torus(1, 0.35, 24, 12, dice.below(2) == 0), material, placed(dice, position, part_size));
        } else if (kind == 2) {
            scene.add(name, icosphere(1, 1 + dice.below(3), dice.below(2) == 0), material, placed(dice, position, part_size));
        } else {
            scene.add_sphere(name, position, part_size, material);
        }
    }
    scene.shine(scene.add("panel", quad({-2, 5, -2}, {4, 0, 0}, {0, 0, 3}, 2), black), {9, 8, 7});
    scene.shine(scene.add("screen", quad({-5, 0.5, -3}, {0, 0, 2}, {0, 2, 0}), black), {1, 3, 4}, true);
    scene.shine(scene.add_sphere("lamp", {3.2, 2.4, 2}, 0.3, black), {14, 9, 4});
    scene.shine(scene.add("lantern", icosphere(0.25, 1), materials[0], Transform::translate(-2.5, 3, 2.5)), {4, 9, 4});
    scene.infinite_light({0.08, 0.09, 0.12});
    return scene.finish();
}

Scene painted_small(uint32_t n, PictureSize size) {
    SceneBuilder scene(size);
    Dice dice(5);
    const auto paint = [&dice](TriangleMesh mesh) {
        for (size_t i = 0; i < mesh.positions.size(); i++) mesh.colors.push_back(dice.below(1u << 24));
        return mesh;
    };
    scene.camera({0, -5.5, 2.6}, {0, 0, -0.2}, {0, 0, 1}, 45);
    scene.infinite_light({0.6, 0.6, 0.6});
    scene.distant_light({0.5, 0.25, 0.6}, {2.6, 2.3, 1.9});
    const uint32_t matt = scene.material(diffuse(Vec3(0.5))), mirror = scene.material(conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, 0));
    TriangleMesh hills = patch(n, n, [](double s, double t) { return Vec3(10 * (s - 0.5), 10 * (t - 0.5), terrain_height(s, t)); });
    TriangleMesh smooth = hills;
    add_normals(smooth);
    scene.add("hills", paint(hills), matt);
    scene.add("smooth hills", paint(smooth), matt, Transform::translate(0, 0, 0.02) * Transform::rotate(90, 0, 0, 1));
    for (uint32_t i = 0; i < 12; i++) {
        const Vec3 position(dice.between(-3, 3), dice.between(-3, 3), dice.between(0, 1));
        TriangleMesh ring = torus(1, 0.35, 24, 12, i % 2 == 0);
        scene.add(fmt::format("torus {}", i), i % 3 ? paint(std::move(ring)) : std::move(ring), i == 4 ? mirror : matt, placed(dice, position, 0.3));
    }
    scene.add_points("cloud", hills_of_points(dice, 500), true, matt);
    scene.add_sphere("ball", {1, -2.5, 0.8}, 0.4, scene.material(glass(1.5)));
    scene.shine(scene.add("lamp", paint(torus(1, 0.35, 8, 6, false)), matt, placed(dice, {-1, -2, 1.5}, 0.1)), {14, 9, 4});
    return scene.finish();
}

Scene cloud_small(uint32_t points, bool among_meshes, uint64_t seed, PictureSize size) {
    SceneBuilder scene(size);
    Dice dice(seed);
    scene.camera({0, -5.5, 2.6}, {0, 0, -0.2}, {0, 0, 1}, 45);
    const uint32_t matt = scene.material(diffuse(Vec3(0.5)));
    scene.add_points("cloud", hills_of_points(dice, points), true, matt);
    scene.infinite_light({0.35, 0.45, 0.65});
    scene.distant_light({0.5, 0.25, 0.6}, {2.6, 2.3, 1.9});
    if (!among_meshes) return scene.finish();
    TriangleMesh hills = patch(40, 40, [](double s, double t) { return Vec3(10 * (s - 0.5), 10 * (t - 0.5), terrain_height(s, t) - 0.03); });
    add_normals(hills);
    // The same material as the cloud's: the colours of points must not spill over.
    scene.add("hills", std::move(hills), matt);
    std::vector<CloudPoint> beads;
    for (uint32_t i = 0; i < points / 10; i++) {
        const Vec3 p(dice.between(-2, 2), dice.between(-3, 0), dice.between(0.3, 1.2));
        beads.push_back({p.to_float(), storable_radius(dice, -6, -5), 0});
    }
    scene.add_points("beads", std::move(beads), false, scene.material(conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, 0)));
    for (uint32_t i = 0; i < 12; i++) {
        const Vec3 position(dice.between(-3, 3), dice.between(-3, 3), dice.between(0, 1));
        scene.add(fmt::format("part {}", i), i % 2 ? torus(1, 0.35, 24, 12, true) : box(Vec3(-1), Vec3(1), 2), matt, placed(dice, position, 0.3));
    }
    scene.add_sphere("ball", {1, -2.5, 0.8}, 0.4, scene.material(glass(1.5)));
    scene.shine(scene.add_sphere("lamp", {-1, -2, 1.5}, 0.15, scene.material(absorber())), {14, 9, 4});
    return scene.finish();
}

Scene soup(uint32_t n, uint64_t seed, PictureSize size) {
    SceneBuilder scene(size);
    Dice dice(seed);
    TriangleMesh mesh;
    for (uint32_t i = 0; i < n; i++) {
        const Vec3 a = dice.point(-1, 1), extent(std::exp2(dice.between(-10, -1)));
        const Vec3 b = a + extent * dice.point(-1, 1);
        Vec3 c = a + extent * dice.point(-1, 1);
        // A third are slivers: the third corner close to the line through the others, down to below float's steps.
        if (i % 3 == 0) c = a + dice.between(0, 1) * (b - a) + std::exp2(dice.between(-26, -6)) * dice.point(-1, 1);
        for (const Vec3& p : {a, b, c}) mesh.positions.push_back(p.to_float());
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    scene.add("soup", std::move(mesh), scene.material(diffuse({0.6, 0.5, 0.4})));
    scene.camera({0.4, 0.7, 4}, {0, 0, 0}, {0, 1, 0}, 38);
    scene.infinite_light(Vec3(1));
    return scene.finish();
}

Scene shared_edges(uint32_t divisions, PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t material = scene.material(diffuse(Vec3(0.7)));
    const double n = divisions;
    // On integers, parallel to the axes: rays through edges can meet them exactly.
    scene.add("grid", quad({-n, -n, 0}, {2 * n, 0, 0}, {0, 2 * n, 0}, 2 * divisions), material);
    scene.add("wall", quad({-n, n, 0}, {2 * n, 0, 0}, {0, 0, n}, divisions), material);
    scene.add("block", box({1, 1, 1}, {3, 3, 3}, divisions), material);
    // Fans, many triangles in a point; one of them far from the origin of its coordinates, with a short edge each.
    scene.add("fan", fan({-4, -4, 2}, 2, 5 * divisions), material);
    scene.add("turned fan", fan({0, 0, 0}, 1.5, 3 * divisions), material, Transform::translate(-3, 3, 1.5) * Transform::rotate(37, 1, 2, 3));
    // Closed surfaces at odd angles.
    scene.add("turned box", box({-1, -1, -1}, {1, 1, 1}, divisions), material, Transform::translate(4, -3, 2) * Transform::rotate(50, 3, 1, 2));
    scene.add("ball", icosphere(1.3, 3), material, Transform::translate(0.3, -0.6, 3.1));
    scene.camera({-0.4 * n, -2.2 * n, 1.6 * n}, {0, 0, 1}, {0, 0, 1}, 50);
    scene.infinite_light(Vec3(1));
    return scene.finish();
}

Scene overlapping_shells(uint32_t shells, uint32_t subdivisions, PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t clear = scene.material(glass(1.05)), mirror = scene.material(conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, 0)),
                   warm = scene.material(diffuse({0.8, 0.5, 0.3})), cold = scene.material(diffuse({0.3, 0.5, 0.8}));
    const double turn = 360.0 / std::max(1u, shells);
    const uint32_t clear_shells = shells / 4;
    for (uint32_t i = 0; i < shells; i++) {
        const Transform turned = Transform::rotate(turn * i, 1, 2, 3);
        if (i < clear_shells) {
            scene.add(fmt::format("clear shell {}", i), icosphere(1.3 + 0.7 * i / shells, subdivisions), clear, turned);
            continue;
        }
        // Shells whose centres lie on a small ring, so that each cuts all others.
        const uint32_t material = i % 3 == 0 ? mirror : i % 3 == 1 ? warm : cold;
        scene.add(fmt::format("cutting shell {}", i), icosphere(0.7 + 0.2 * i / shells, subdivisions), material,
                  turned * Transform::translate(0.3, 0.1, 0));
    }
    scene.camera({0, 1.5, 5}, {0, 0, 0}, {0, 1, 0}, 42);
    scene.infinite_light({0.8, 0.9, 1});
    scene.distant_light({1, 2, 1.5}, {1.5, 1.4, 1.2});
    Scene result = scene.finish();
    result.max_depth = 4 * clear_shells + 4;  // in and out, and a few bounces inside
    return result;
}

}  // namespace raypager::reference
