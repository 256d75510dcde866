// make_scene island: as many instances as asked for, on the ground, in a scene that loads without a warning; copies that do not overlap.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "procedural/island_land.hpp"
#include "procedural/island_plan.hpp"
#include "procedural/island_plants.hpp"
#include "procedural/island_strand.hpp"
#include "procedural/make_scene.hpp"
#include "raypager/bake.hpp"
#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/procedural_meshes.hpp"

namespace raypager {
namespace {

using namespace procedural_test;

MakeSceneOptions island(const std::filesystem::path& folder, uint64_t instances, uint64_t triangles, uint64_t copies = 0) {
    MakeSceneOptions options;
    options.kind = "island";
    options.directory = folder;
    options.instances = instances;
    options.triangles = triangles;
    options.copies = copies;
    return options;
}

TEST(ProceduralIsland, HasAsManyInstancesAsAsked) {
    for (const uint64_t instances : {1u, 2u, 17u, 999u, 30'001u}) {
        const support::TemporaryFolder folder;
        const auto made = make_scene(island(folder.path(), instances, 3000));
        ASSERT_TRUE(made.ok()) << made.status().message();
        EXPECT_EQ(made->instances, instances);
        EXPECT_EQ(instance_lines(folder.path()).size(), instances);
    }
}

TEST(ProceduralIsland, PlacesAllKindsOnTheGround) {
    const support::TemporaryFolder folder;
    const MakeSceneOptions options = island(folder.path(), 5000, 60'000);
    ASSERT_TRUE(make_scene(options).ok());
    const IslandPlan plan(options);
    const IslandLand land(plan.radius, plan.ground_quads, options.seed);
    std::map<std::string, uint64_t> objects;
    uint64_t beside_water = 0;
    for (const std::string& line : instance_lines(folder.path())) {
        const InstanceLine i = parse_instance(line);
        objects[i.object.substr(0, i.object.find('-'))]++;
        const auto &x = i.columns[0], &y = i.columns[1], &z = i.columns[2];
        const Vector at = i.columns[3] + land.eye();
        EXPECT_GT(std::abs(dot(cross(x, y), z)), 1e-5) << line;
        EXPECT_GT(y[1], 0) << "upside down: " << line;
        EXPECT_GT(land.inland(at[0], at[2]), 0) << "in the sea: " << line;
        // What lies on its side has its middle above the ground, by a fifth of its size at most.
        const double above = at[1] - land.footing(at[0], at[2]).height;
        EXPECT_GT(above, -1e-3) << line;
        EXPECT_LT(above, 0.21 * length(x) + 1e-3) << line;
        beside_water += land.inland(at[0], at[2]) < land.beach();
    }
    for (const IslandKind& kind : plan.things) EXPECT_EQ(objects[std::string(kind.name)], kind.instances) << kind.name;
    EXPECT_EQ(objects.size(), island_things);
    EXPECT_GT(beside_water, 700u) << "beaches are not bare";
}

TEST(ProceduralIsland, FootingIsOnTheTrianglesOfTheGround) {
    const support::TemporaryFolder folder;
    const MakeSceneOptions options = island(folder.path(), 100, 10'000);
    ASSERT_TRUE(make_scene(options).ok());
    const IslandPlan plan(options);
    const IslandLand land(plan.radius, plan.ground_quads, options.seed);
    const auto loaded = import_scene({folder / "scene.pbrt"});
    ASSERT_TRUE(loaded.ok());
    Random random(3);
    uint64_t found = 0;
    for (const Shape& shape : loaded->shapes) {
        const MeshSource* file = shape.mesh.get();
        if (!file || file->name().find("ground-") == std::string::npos) continue;
        TriangleMesh mesh;
        MeshIssues issues;
        ASSERT_TRUE(shape.mesh->load(mesh, issues).ok());
        for (int i = 0; i < 300; i++) {
            const Triangle& t = mesh.triangles[random.below(static_cast<uint32_t>(mesh.triangles.size()))];
            double a = random.uniform(), b = random.uniform();
            if (a + b > 1) a = 1 - a, b = 1 - b;
            const Vector p =
                vector(mesh.positions[t[0]]) * (1 - a - b) + vector(mesh.positions[t[1]]) * a + vector(mesh.positions[t[2]]) * b + land.eye();
            ASSERT_NEAR(land.footing(p[0], p[2]).height, p[1], 2e-3);
            found++;
        }
    }
    EXPECT_GE(found, 300u);
}

// Lines of a text that are those of instances of an object.
std::vector<InstanceLine> copies_in(const std::filesystem::path& folder) {
    std::vector<InstanceLine> copies;
    for (const std::string& line : instance_lines(folder)) {
        InstanceLine parsed = parse_instance(line);
        if (parsed.object == "island") copies.push_back(parsed);
    }
    return copies;
}

TEST(ProceduralIsland, CopiesAreOneObjectWithItsInstances) {
    const support::TemporaryFolder folder;
    const auto made = make_scene(island(folder.path(), 500, 3000, 7));
    ASSERT_TRUE(made.ok()) << made.status().message();
    EXPECT_EQ(made->instances, 7 * 500u + 7u);
    EXPECT_EQ(instance_lines(folder.path()).size(), 500u + 7u);
    EXPECT_EQ(copies_in(folder.path()).size(), 7u);
    const std::string text = *read_text(made->scene_file);
    const size_t begin = text.find("ObjectBegin \"island\""), end = text.find("ObjectEnd", begin);
    ASSERT_NE(begin, std::string::npos);
    EXPECT_EQ(text.find("ObjectBegin", begin + 1), std::string::npos) << "objects are defined before it";
    EXPECT_LT(begin, text.find("instances/tree-"));
    EXPECT_GT(end, text.find("instances/tree-"));
    EXPECT_LT(end, text.find("instances/island.pbrt"));
}

TEST(ProceduralIsland, WithoutCopiesNothingIsNested) {
    const support::TemporaryFolder folder;
    const auto made = make_scene(island(folder.path(), 500, 3000, 1));
    ASSERT_TRUE(made.ok());
    EXPECT_EQ(read_text(made->scene_file)->find("\"island\""), std::string::npos);
    EXPECT_TRUE(copies_in(folder.path()).empty());
}

TEST(ProceduralIsland, CopiesDoNotOverlap) {
    for (const uint64_t copies : {2u, 26u, 1000u}) {
        const std::vector<IslandPlace> places = archipelago(copies, 100, 5);
        ASSERT_EQ(places.size(), copies);
        EXPECT_TRUE(places[0].x == 0 && places[0].z == 0 && places[0].turn.sin == 0 && places[0].turn.cos == 1) << "the view is of this one";
        double farthest = 0;
        for (size_t i = 0; i < copies; i++) {
            EXPECT_LT(places[i].z, 30) << "behind the one that is looked at, or beside it";
            farthest = std::max(farthest, std::hypot(places[i].x, places[i].z));
            for (size_t j = 0; j < i; j++) ASSERT_GE(std::hypot(places[i].x - places[j].x, places[i].z - places[j].z), 100 - 1e-9) << i << " " << j;
        }
        EXPECT_LT(farthest, 110 * (1.2 * std::sqrt(static_cast<double>(copies)) + 1)) << "close together";
    }
}

// Their middles are farther apart than the corners of two squares of land reach, however these are turned.
TEST(ProceduralIsland, TurnsCopiesAboutTheirMiddle) {
    const support::TemporaryFolder folder;
    const MakeSceneOptions options = island(folder.path(), 100, 2000, 5);
    ASSERT_TRUE(make_scene(options).ok());
    const IslandPlan plan(options);
    const IslandLand land(plan.radius, plan.ground_quads, options.seed);
    std::vector<Vector> middles;
    for (const InstanceLine& i : copies_in(folder.path())) {
        const Vector m = land.eye() * -1;
        middles.push_back(i.columns[0] * m[0] + i.columns[1] * m[1] + i.columns[2] * m[2] + i.columns[3]);
        EXPECT_NEAR(length(i.columns[0]), 1, 1e-6);
        EXPECT_NEAR(dot(cross(i.columns[0], i.columns[1]), i.columns[2]), 1, 1e-6) << "not mirrored";
    }
    ASSERT_EQ(middles.size(), 5u);
    for (size_t i = 0; i < middles.size(); i++) {
        EXPECT_NEAR(middles[i][1], -land.eye()[1], 1e-3) << "all in the same sea";
        for (size_t j = 0; j < i; j++) EXPECT_GT(length(middles[i] - middles[j]), 2 * std::sqrt(2.0) * land.half() - 0.01);
    }
}

TEST(ProceduralIsland, LoadsWithoutWarningsAndBakes) {
    const support::TemporaryFolder folder;
    const auto made = make_scene(island(folder.path(), 700, 40'000));
    ASSERT_TRUE(made.ok()) << made.status().message();
    const auto scene = import_scene({made->scene_file});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_TRUE(scene->warnings.empty()) << scene->warnings[0];
    const auto baked = bake(*scene, BakeOptions());
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    EXPECT_EQ(baked->summary.triangles, made->triangles) << "nothing is a copy, and nothing is lost";
    for (const auto& file : folder.files()) {
        if (file.extension() != ".ply") continue;
        TriangleMesh mesh = *read_ply(file), loaded;
        MeshIssues issues;
        ASSERT_TRUE(MeshInMemory(file.string(), std::move(mesh)).load(loaded, issues).ok());
        EXPECT_FALSE(issues.any()) << file << ": " << issues.describe();
    }
}

// An island with all its instances is an object: written out where it stands, or as it is.
TEST(ProceduralIsland, CopiesLoadAndBake) {
    const support::TemporaryFolder folder;
    const auto made = make_scene(island(folder.path(), 3000, 60'000, 3));
    ASSERT_TRUE(made.ok()) << made.status().message();
    const auto scene = import_scene({made->scene_file});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_TRUE(scene->warnings.empty()) << scene->warnings[0];
    BakeOptions bake_options;
    const auto written_out = bake(*scene, bake_options);
    ASSERT_TRUE(written_out.ok()) << written_out.status().message();
    bake_options.flatten_limit = 0;
    const auto nested = bake(*scene, bake_options);
    ASSERT_TRUE(nested.ok()) << nested.status().message();
    // The island itself, its instances, and what is placed once in it.
    EXPECT_EQ(nested->summary.instances, 3u + 3000u);
    EXPECT_EQ(written_out->summary.instances, 3u + 3 * 3000u);
    EXPECT_EQ(nested->summary.triangles, written_out->summary.triangles);
}

TEST(ProceduralIsland, PlantsHaveAboutTheTrianglesThatTheyAreGiven) {
    Random random(5);
    const auto near = [](uint64_t made, uint64_t wanted, const char* what) {
        EXPECT_LE(made, wanted * 3 / 2) << what << " " << wanted;
        EXPECT_GE(made, wanted / 2) << what << " " << wanted;
    };
    for (const uint64_t triangles : {120u, 1000u, 9000u, 100'000u}) {
        const Palm palm = grow_palm(triangles, random);
        near(palm.wood.triangles.size() + palm.leaves.triangles.size(), triangles, "palm");
        near(grow_rosette(triangles, random).triangles.size(), triangles, "rosette");
        const TriangleMesh fern = grow_fern(triangles, random);
        near(fern.triangles.size(), triangles, "fern");
        EXPECT_EQ(fern.uvs.size(), fern.positions.size());
        const Hedge hedge = grow_hedge(triangles, random);
        near(hedge.leaves.triangles.size() + hedge.flowers.triangles.size(), triangles, "hedge");
        near(make_shell(triangles, random).triangles.size(), triangles, "shell");
        near(make_coral(triangles, random).triangles.size(), triangles, "coral");
        near(make_driftwood(triangles, random).triangles.size(), triangles, "driftwood");
    }
    EXPECT_EQ(make_fallen_leaf(random).triangles.size(), fallen_leaf_triangles);
}

TEST(ProceduralIsland, AWarpedAxisRisesAndIsFinestAtItsFocus) {
    const WarpedAxis axis{-50, 30, 20, 0.1};
    const std::vector<double> lines = axis.lines(200);
    EXPECT_EQ(lines.front(), -50);
    EXPECT_EQ(lines.back(), 30);
    double narrowest = 100, at = 0;
    for (size_t i = 1; i < lines.size(); i++) {
        ASSERT_GT(lines[i], lines[i - 1]);
        if (lines[i] - lines[i - 1] < narrowest) narrowest = lines[i] - lines[i - 1], at = lines[i];
        EXPECT_NEAR(axis.inverse(lines[i]), static_cast<double>(i) / 200, 1e-9);
    }
    EXPECT_NEAR(at, 20, 1);
    EXPECT_NEAR(narrowest, 0.1 * 80 / 200, 0.01);
}

TEST(ProceduralIsland, MoanasNumbersAreAPreset) {
    MakeSceneOptions options;
    ASSERT_TRUE(apply_preset("moana", options).ok());
    EXPECT_EQ(options.triangles, 522'000'000u);
    EXPECT_EQ(options.instances, 39'300'000u);
    options.instances = 1000;
    ASSERT_TRUE(apply_preset("moana", options).ok());
    EXPECT_EQ(options.instances, 1000u) << "what is asked for stays";
    EXPECT_EQ(apply_preset("frozen", options).exit_code(), 2);
    // As the plan spends them: most instances are small, most triangles are in what grows.
    options.instances = 39'300'000;
    const IslandPlan plan(options);
    uint64_t instances = 0, small = 0, triangles = 0, grown = 0;
    for (size_t i = 0; i < island_things; i++) {
        const auto thing = static_cast<IslandThing>(i);
        const IslandKind& kind = plan[thing];
        instances += kind.instances;
        if (thing < IslandThing::rosette && thing != IslandThing::boulder) small += kind.instances;
        triangles += kind.kinds * kind.triangles;
        if (thing >= IslandThing::rosette) grown += kind.kinds * kind.triangles;
    }
    EXPECT_EQ(instances, 39'300'000u);
    EXPECT_GT(small, instances / 2);
    EXPECT_LT(triangles, options.triangles * 3 / 4) << "trees get the rest";
    EXPECT_GT(grown, triangles / 2);
}

TEST(ProceduralIsland, RefusesWhatCannotBeMade) {
    const support::TemporaryFolder folder;
    EXPECT_EQ(make_scene(island(folder.path(), 1'000'000'001, 1000)).status().exit_code(), 2);
    EXPECT_EQ(make_scene(island(folder.path(), 100, 1000, 1001)).status().exit_code(), 2);
    MakeSceneOptions options = island(folder.path(), 100, 1000, 2);
    options.kind = "forest";
    EXPECT_EQ(make_scene(options).status().exit_code(), 2) << "copies are for islands";
}

}  // namespace
}  // namespace raypager
