// make_scene forest: as many instances as asked for, of plants that are sound, in a scene that loads without a warning.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "procedural/make_scene.hpp"
#include "procedural/plants.hpp"
#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/procedural_meshes.hpp"

namespace raypager {
namespace {

using namespace procedural_test;

MakeSceneOptions forest(const std::filesystem::path& folder, uint64_t instances, uint64_t triangles) {
    MakeSceneOptions options;
    options.kind = "forest";
    options.directory = folder;
    options.instances = instances;
    options.triangles = triangles;
    return options;
}

TEST(ProceduralForest, HasAsManyInstancesAsAsked) {
    for (const uint64_t instances : {1u, 2u, 17u, 1000u, 40'001u}) {
        const support::TemporaryFolder folder;
        const auto made = make_scene(forest(folder.path(), instances, 5000));
        ASSERT_TRUE(made.ok()) << made.status().message();
        EXPECT_EQ(made->instances, instances);
        size_t files = 0;
        EXPECT_EQ(instance_lines(folder.path(), &files).size(), instances);
        const std::string scene = *read_text(made->scene_file);
        size_t included = 0;
        for (size_t at = scene.find("Include \"instances/"); at != std::string::npos; at = scene.find("Include \"instances/", at + 1)) included++;
        EXPECT_EQ(included, files);
    }
}

TEST(ProceduralForest, ManyInstancesAreSeveralFiles) {
    const support::TemporaryFolder folder;
    ASSERT_TRUE(make_scene(forest(folder.path(), 150'000, 1000)).ok());
    size_t files = 0;
    EXPECT_EQ(instance_lines(folder.path(), &files).size(), 150'000u);
    EXPECT_GE(files, 5u);
    for (const auto& entry : std::filesystem::directory_iterator(folder / "instances")) EXPECT_LT(entry.file_size(), 6u << 20) << entry.path();
}

TEST(ProceduralForest, PlacesAllKindsOnTheLandSomeOfThemMirrored) {
    const support::TemporaryFolder folder;
    ASSERT_TRUE(make_scene(forest(folder.path(), 3000, 60'000)).ok());
    std::set<std::string> objects;
    size_t mirrored = 0;
    const double side = 4.6 * std::sqrt(3000 - 3000 / 16 - 3000 * 9 / 16);
    for (const std::string& line : instance_lines(folder.path())) {
        const InstanceLine i = parse_instance(line);
        objects.insert(i.object);
        const auto &x = i.columns[0], &y = i.columns[1], &z = i.columns[2], &at = i.columns[3];
        const double volume = dot(cross(x, y), z);
        mirrored += volume < 0;
        EXPECT_GT(std::abs(volume), 1e-3) << line;
        EXPECT_LT(std::abs(volume), 30) << line;
        EXPECT_GT(y[1], 0) << "upside down: " << line;
        EXPECT_TRUE(std::abs(at[0]) <= side * 0.501 && at[2] >= -0.931 * side && at[2] <= 0.071 * side) << line;
    }
    EXPECT_EQ(objects.size(), 36u + 6u + 6u);
    EXPECT_GT(mirrored, 600u);
    EXPECT_LT(mirrored, 2000u);
}

TEST(ProceduralForest, LoadsWithoutWarnings) {
    const support::TemporaryFolder folder;
    const auto made = make_scene(forest(folder.path(), 300, 40'000));
    ASSERT_TRUE(made.ok()) << made.status().message();
    const auto scene = import_scene({made->scene_file});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_TRUE(scene->warnings.empty()) << scene->warnings[0];
    for (const auto& file : folder.files()) {
        if (file.extension() != ".ply") continue;
        TriangleMesh mesh = *read_ply(file), loaded;
        MeshIssues issues;
        ASSERT_TRUE(MeshInMemory(file.string(), std::move(mesh)).load(loaded, issues).ok());
        EXPECT_FALSE(issues.any()) << file << ": " << issues.describe();
    }
}

TEST(ProceduralForest, PlantsHaveTheTrianglesThatTheyAreGiven) {
    Random random(5);
    for (const TreeHabit habit : {TreeHabit::conifer, TreeHabit::broadleaf})
        for (const uint64_t triangles : {60u, 61u, 200u, 999u, 12'000u, 150'001u}) {
            const Tree tree = grow_tree(habit, triangles, random);
            const uint64_t made = tree.wood.triangles.size() + tree.leaves.triangles.size();
            EXPECT_LE(made, triangles);
            EXPECT_GE(made + 1, triangles);
            EXPECT_GT(tree.leaves.triangles.size(), triangles / 2);
            for (const TriangleMesh* mesh : {&tree.wood, &tree.leaves})
                for (const Float3& p : mesh->positions)
                    ASSERT_TRUE(std::abs(p.x) < 25 && p.y > -6 && p.y < 35 && std::abs(p.z) < 25) << p.x << " " << p.y << " " << p.z;
        }
    EXPECT_EQ(grow_tuft(100, random).triangles.size(), 99u);
    for (const uint64_t triangles : {10u, 100u, 20'000u}) {
        const TriangleMesh rock = make_rock(triangles, random);
        const EdgeCounts edges = count_edges(rock);
        EXPECT_EQ(edges.open + edges.tangled, 0u);
        EXPECT_GT(signed_volume(rock), 0);
        const auto at_least = static_cast<double>(std::max<uint64_t>(triangles, 36));
        EXPECT_NEAR(static_cast<double>(rock.triangles.size()), at_least, 0.4 * at_least);
    }
}

TEST(ProceduralForest, AloneHasInstances) {
    const support::TemporaryFolder folder;
    EXPECT_EQ(make_scene(forest(folder.path(), 1'000'000'001, 1000)).status().exit_code(), 2);
    MakeSceneOptions options = forest(folder.path(), 100, 1000);
    options.kind = "terrain";
    EXPECT_EQ(make_scene(options).status().exit_code(), 2);
    options = forest(folder.path(), 100, 1000);
    options.textures = 20;
    EXPECT_EQ(make_scene(options).status().exit_code(), 2);
}

}  // namespace
}  // namespace raypager
