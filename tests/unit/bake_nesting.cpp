// What objects place stays in them, or is put where they are placed.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "bake/nesting.hpp"

namespace raypager {
namespace {

Placement at(uint32_t object, double x, double size = 1) {
    Placement placement{object, {}};
    const Transform t = Transform::translate(x, 0, 0) * Transform::scale(size, size, size);
    std::copy_n(t.m.begin(), 3, placement.to_world.begin());
    return placement;
}

std::shared_ptr<const InstanceSource> source(std::vector<Placement> placements) {
    return std::make_shared<InstancesInMemory>("source", std::move(placements));
}

// Object k places object k - 1 `each` times; the world the last one.
Scene chain(uint32_t objects, uint32_t each) {
    Scene scene;
    const auto placements_of = [each](uint32_t object) {
        std::vector<Placement> placements;
        for (uint32_t i = 0; i < each; i++) placements.push_back(at(object, i, 0.5));
        return placements;
    };
    for (uint32_t i = 0; i < objects; i++) {
        scene.objects.push_back({"o" + std::to_string(i), {}});
        if (i > 0) scene.objects.back().instances.push_back(source(placements_of(i - 1)));
    }
    scene.instances.push_back(source(placements_of(objects - 1)));
    return scene;
}

std::vector<Placement> all_of(const InstanceSources& sources) {
    std::vector<Placement> all;
    for (const auto& one : sources) {
        const size_t before = all.size();
        EXPECT_TRUE(one->stream([&](std::span<const Placement> some) { return all.insert(all.end(), some.begin(), some.end()), Status(); }).ok());
        EXPECT_EQ(all.size() - before, one->count());
    }
    return all;
}

uint32_t levels_of(const Nesting& nesting) {
    std::vector<uint32_t> levels(nesting.of_objects.size(), 0);
    uint32_t world = 0;
    for (size_t i = 0; i <= levels.size(); i++)
        for (const Placement& placement : all_of(i < levels.size() ? nesting.of_objects[i] : nesting.of_world)) {
            uint32_t& level = i < levels.size() ? levels[i] : world;
            level = std::max(level, levels[placement.object] + 1);
        }
    return world;
}

TEST(BakeNesting, WithoutNestedObjectsAllStaysAsItIs) {
    Scene scene = chain(1, 5);
    const auto nesting = plan_nesting(scene, 4, 0);
    ASSERT_TRUE(nesting.ok());
    EXPECT_EQ(nesting->of_world, scene.instances);
    ASSERT_EQ(nesting->of_objects.size(), 1u);
    EXPECT_TRUE(nesting->of_objects[0].empty());
}

TEST(BakeNesting, FewAreWrittenOut) {
    const auto nesting = plan_nesting(chain(3, 2), 4, 1000);
    ASSERT_TRUE(nesting.ok()) << nesting.status().message();
    for (const auto& sources : nesting->of_objects) EXPECT_TRUE(sources.empty());
    std::map<uint32_t, std::vector<double>> places;
    for (const Placement& p : all_of(nesting->of_world)) {
        places[p.object].push_back(p.to_world[0][3]);
        // Each level halves the size.
        EXPECT_EQ(p.to_world[1][1], p.object == 2 ? 0.5 : p.object == 1 ? 0.25 : 0.125);
    }
    EXPECT_EQ(places[2], (std::vector<double>{0, 1}));
    EXPECT_EQ(places[1], (std::vector<double>{0, 0.5, 1, 1.5}));
    EXPECT_EQ(places[0], (std::vector<double>{0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75}));
}

TEST(BakeNesting, ManyStayInTheirObjects) {
    const auto nesting = plan_nesting(chain(3, 3), 4, 0);
    ASSERT_TRUE(nesting.ok()) << nesting.status().message();
    EXPECT_EQ(all_of(nesting->of_world).size(), 3u);
    EXPECT_EQ(all_of(nesting->of_objects[2]).size(), 3u);
    EXPECT_EQ(all_of(nesting->of_objects[1]).size(), 3u);
    EXPECT_EQ(levels_of(*nesting), 3u);
}

TEST(BakeNesting, WhatIsPlacedOnceSavesNothing) {
    const auto nesting = plan_nesting(chain(6, 1), 4, 0);
    ASSERT_TRUE(nesting.ok()) << nesting.status().message();
    EXPECT_EQ(levels_of(*nesting), 1u);
    EXPECT_EQ(all_of(nesting->of_world).size(), 6u);
}

TEST(BakeNesting, DeeperThanKernelsGoIsWrittenOut) {
    for (const uint32_t levels : {1u, 2u, 4u}) {
        const auto nesting = plan_nesting(chain(6, 3), levels, 0);
        ASSERT_TRUE(nesting.ok()) << nesting.status().message();
        EXPECT_LE(levels_of(*nesting), levels);
    }
}

TEST(BakeNesting, OfABillionLevelsOrInstancesThereAreFew) {
    // Placed once each, or twice, through thousands of levels.
    const auto once = plan_nesting(chain(3000, 1), 4, uint64_t{1} << 16);
    ASSERT_TRUE(once.ok()) << once.status().message();
    EXPECT_EQ(levels_of(*once), 1u);
    const auto twice = plan_nesting(chain(3000, 2), 4, uint64_t{1} << 16);
    ASSERT_FALSE(twice.ok());
    EXPECT_NE(twice.status().message().find("nest them less deeply"), std::string::npos) << twice.status().message();
}

TEST(BakeNesting, RefusesWhatDoesNotComeBefore) {
    Scene scene = chain(2, 2);
    scene.objects[0].instances.push_back(source({at(1, 0)}));
    EXPECT_FALSE(plan_nesting(scene, 4, 0).ok());
    scene = chain(2, 2);
    scene.objects[1].instances.push_back(source({at(1, 0)}));
    const auto itself = plan_nesting(scene, 4, 0);
    ASSERT_FALSE(itself.ok());
    EXPECT_NE(itself.status().message().find("object 1 (\"o1\") places object 1 (\"o1\")"), std::string::npos) << itself.status().message();
}

}  // namespace
}  // namespace raypager
