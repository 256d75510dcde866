// Generated shapes are closed, consistently oriented, and of the size that their parameters say.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "procedural/assemblies.hpp"
#include "procedural/noise.hpp"
#include "procedural/parts.hpp"
#include "procedural/surface.hpp"
#include "support/temporary_folder.hpp"
#include "unit/procedural_meshes.hpp"

namespace raypager {
namespace {

using namespace procedural_test;
using std::numbers::pi;

Pose tilted() { return Pose::along({0.5, -0.25, 1}, {1, 2, -0.5}, 0.3); }

void expect_closed(const TriangleMesh& mesh, const char* what) {
    const EdgeCounts edges = count_edges(mesh);
    EXPECT_EQ(edges.open, 0u) << what;
    EXPECT_EQ(edges.tangled, 0u) << what;
    EXPECT_EQ(edges.paired * 2, mesh.triangles.size() * 3) << what;
    EXPECT_GT(signed_volume(mesh), 0) << what;
}

// relative: what the polygons cut off the round shape.
void expect_volume(const TriangleMesh& mesh, double volume, double relative, const char* what) {
    expect_closed(mesh, what);
    EXPECT_NEAR(signed_volume(mesh), volume, relative * volume) << what;
}

TEST(ProceduralParts, AreClosedAndOfTheRightVolume) {
    TriangleMesh mesh;
    const auto fresh = [&mesh]() -> TriangleMesh& { return mesh = {}; };
    // A polygon of n corners has sin(2 pi / n) n / (2 pi) of the circle's area: 0.3 % less for 48, 0.6 % with a second such factor.
    add_cylinder(fresh(), tilted(), 0.5, 2, 48);
    expect_volume(mesh, pi * 0.25 * 2, 0.004, "cylinder");
    add_pipe(fresh(), tilted(), 0.5, 0.1, 2, 48);
    expect_volume(mesh, pi * (0.25 - 0.16) * 2, 0.004, "pipe");
    add_ball(fresh(), tilted(), 0.5, 64);
    expect_volume(mesh, pi / 6, 0.006, "ball");
    add_torus(fresh(), tilted(), 1, 0.25, 48, 48);
    expect_volume(mesh, 2 * pi * pi * 0.0625, 0.008, "torus");
    add_beam(fresh(), tilted(), 0.5, 1, 3);
    expect_volume(mesh, 3 * (2 * 1.0 * 0.16 + 0.09 * (2 - 0.32)), 1e-5, "beam");
    const std::array<Vector, 2> rod = {Vector{0, 0, 0}, Vector{3, 4, 0}};
    add_bar(fresh(), rod, 0.1, 48);
    expect_volume(mesh, 5 * pi * 0.01, 0.004, "bar");
    add_perforated_plate(fresh(), tilted(), 3, 2, 1, 0.3, 6, 0.2);
    expect_volume(mesh, 0.2 * 6 * (1 - pi * 0.09), 0.004, "plate");
    add_gear(fresh(), tilted(), 1, 24, 0.3, 0.2, 3);
    expect_closed(mesh, "gear");
    add_spring(fresh(), tilted(), 1, 0.1, 3, 6, 12);
    expect_closed(mesh, "spring");
    add_bolt(fresh(), tilted(), 0.2, 1, 16, 6);
    expect_closed(mesh, "bolt");
}

TEST(ProceduralParts, EveryAssemblyIsClosedAtEveryDetail) {
    const uint64_t seed = 5;
    Random random(seed);
    for (int i = 0; i < 300; i++) {
        Assembly assembly;
        add_random_assembly(assembly, tilted(), 0.1 + 0.01 * (i % 100), 0.1 + 0.01 * (i % 90), random);
        EXPECT_GT(assembly.triangles(), 0u);
        for (const TriangleMesh& mesh : assembly.meshes)
            if (!mesh.triangles.empty()) expect_closed(mesh, "assembly of seed 5");
    }
}

// A scene with one surface, read back.
std::vector<TriangleMesh> written(const std::vector<SurfaceGrid>& grids, uint64_t max_triangles) {
    const support::TemporaryFolder folder;
    MakeSceneOptions options;
    options.directory = folder.path();
    auto scene = SceneWriter::create(options);
    EXPECT_TRUE(scene.ok());
    uint64_t expected = 0, face = 0;
    for (const SurfaceGrid& grid : grids) {
        expected += grid.triangles();
        EXPECT_TRUE(write_surface(*scene, "s" + std::to_string(face++), "m", grid, max_triangles).ok());
    }
    EXPECT_EQ(scene->triangles(), expected);
    std::vector<TriangleMesh> meshes;
    for (const auto& file : folder.files()) {
        auto mesh = read_ply(file);
        EXPECT_TRUE(mesh) << file;
        if (mesh) meshes.push_back(std::move(*mesh));
    }
    return meshes;
}

// Whole, and cut into ever smaller files.
void expect_closed_however_cut(const std::vector<SurfaceGrid>& grids, double volume, double relative, const char* what) {
    for (const uint64_t max_triangles : {uint64_t{1} << 20, uint64_t{1000}, uint64_t{100}}) {
        const std::vector<TriangleMesh> meshes = written(grids, max_triangles);
        EXPECT_GT(meshes.size(), max_triangles == 100 ? 10u : 0u);
        expect_volume(merge_by_position(meshes), volume, relative, what);
    }
}

TEST(ProceduralSurfaces, SphereIsClosedHoweverCut) {
    const auto round = [](const Vector&) { return 2.0; };
    expect_closed_however_cut(displaced_sphere(24, {1, 2, 3}, round), 8 * 4 * pi / 3, 0.01, "sphere");
    const auto bumpy = [](const Vector& d) { return 2 + fractal_noise(d * 5, 4, 0.5, 3) * 0.3; };
    expect_closed(merge_by_position(written(displaced_sphere(31, {0, 0, 0}, bumpy), 500)), "bumpy sphere");
    expect_closed(merge_by_position(written(displaced_sphere(1, {0, 0, 0}, round), 500)), "cube");
}

TEST(ProceduralSurfaces, KnotIsClosedHoweverCut) {
    TorusKnot knot;
    knot.rows = 300;
    knot.columns = 24;
    knot.thickness = [](double, double) { return 0.25; };
    // The volume of a tube is its section times the length of its middle line (Pappus), here summed up numerically.
    double curve = 0;
    const auto point = [&](double t) {
        const SinCos a = sincos_turns(2 * t), b = sincos_turns(3 * t);
        return Vector{(2 + b.cos) * a.cos, (2 + b.cos) * a.sin, b.sin};
    };
    for (int i = 0; i < 10000; i++) curve += length(point((i + 1) / 10000.0) - point(i / 10000.0));
    expect_closed_however_cut({knot_surface(knot)}, curve * pi * 0.0625, 0.02, "knot");
}

TEST(ProceduralSurfaces, TurnedSurfaceIsClosedHoweverCut) {
    Turned cone;
    cone.profile = {{0, 0}, {1, 0}, {1, 0}, {0, 2}};
    cone.rows = 40;
    cone.columns = 30;
    cone.relief = [](double, double) { return 0.0; };
    const std::vector<TriangleMesh> whole = written({turned_surface(cone)}, 1 << 20);
    ASSERT_EQ(whole.size(), 1u);
    expect_closed(whole[0], "its vertices are shared by index within one file");
    expect_closed_however_cut({turned_surface(cone)}, signed_volume(whole[0]), 1e-5, "cone");
}

TEST(ProceduralNumbers, SineAndCosineAreAccurate) {
    for (int i = -3000; i <= 3000; i++) {
        const double turns = i / 777.0;
        const SinCos result = sincos_turns(turns);
        // Both sides round 2 pi turns differently: a few units in the last place of 24.
        EXPECT_NEAR(result.sin, std::sin(2 * pi * turns), 1e-14) << turns;
        EXPECT_NEAR(result.cos, std::cos(2 * pi * turns), 1e-14) << turns;
    }
    EXPECT_EQ(sincos_turns(0.25).sin, 1);
    EXPECT_EQ(sincos_turns(-0.5).cos, -1);
    EXPECT_EQ(sincos_turns(1000000.75).cos, 0);
}

TEST(ProceduralNumbers, RandomNumbersAreEven) {
    Random random(1, 2);
    const int count = 100000;
    double sum = 0, squares = 0;
    std::array<int, 7> bins{};
    for (int i = 0; i < count; i++) {
        const double u = random.uniform();
        ASSERT_TRUE(u >= 0 && u < 1);
        sum += u;
        squares += u * u;
        bins[random.below(7)]++;
    }
    // Five standard deviations of the means (1/sqrt(12 n) and sqrt(4/45/n)) and of a bin's count.
    EXPECT_NEAR(sum / count, 0.5, 5 / std::sqrt(12.0 * count));
    EXPECT_NEAR(squares / count, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / count));
    for (const int bin : bins) EXPECT_NEAR(bin, count / 7.0, 5 * std::sqrt(count / 7.0));
}

TEST(ProceduralNoise, IsSmoothAndItsGradientIsRight) {
    const uint64_t seed = 4;
    for (int i = 0; i < 2000; i++) {
        Random random(seed, static_cast<uint64_t>(i));
        const double x = random.uniform(-50, 50), z = random.uniform(-50, 50), h = 1e-5;
        const Noise2 n = value_noise(x, z, seed);
        EXPECT_LE(std::abs(n.value), 1);
        // A central difference errs by h^2 / 6 times the third derivative (below 400 here) plus rounding 1e-16 / h.
        EXPECT_NEAR(n.dx, (value_noise(x + h, z, seed).value - value_noise(x - h, z, seed).value) / (2 * h), 1e-7);
        EXPECT_NEAR(n.dz, (value_noise(x, z + h, seed).value - value_noise(x, z - h, seed).value) / (2 * h), 1e-7);
        // Slopes of gradient noise stay below about 6 a unit.
        EXPECT_NEAR(gradient_noise({x, z, 1}, seed), gradient_noise({x + h, z, 1}, seed), 10 * h);
    }
}

}  // namespace
}  // namespace raypager
