// A scene that was baked over the disk, in as little memory as possible, is cut into other blocks than one that was baked in memory: it must show the
// same picture, to the bit.
#include <gtest/gtest.h>

#include "reference/instanced_scenes.hpp"
#include "reference/scenes.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"

namespace raypager {
namespace {

// A floor with so many small instances above it, and those of a scene of few among them.
Scene swarm(uint32_t instances) {
    Scene scene = reference::strewn(20, {48, 32});
    std::vector<Placement> placements;
    uint32_t seed = 1;
    const auto random = [&seed] { return (seed = seed * 1664525u + 1013904223u) >> 8; };
    const auto between = [&](double from, double to) { return from + (to - from) * random() / (1 << 24); };
    for (uint32_t i = 0; i < instances; i++) {
        const double x = between(-3.5, 3.5), y = between(-3.5, 3.5), z = between(-0.6, 1), size = between(0.01, 0.03);
        const Transform to_world = Transform::translate(x, y, z) * Transform::rotate(between(0, 360), x, y, 1) * Transform::scale(size, size, size);
        placements.push_back({i % static_cast<uint32_t>(scene.objects.size()), {to_world.m[0], to_world.m[1], to_world.m[2]}});
    }
    scene.instances.push_back(std::make_shared<InstancesInMemory>("swarm", std::move(placements)));
    return scene;
}

struct BakedCase {
    const char* name;
    Scene (*make)();
};

// All large enough not to fit into the smallest limit.
const BakedCase baked_cases[] = {
    {"terrain",
     [] {
         return reference::terrain_small(450, true, {48, 32});
     }},
    {"shells",
     [] {
         return reference::overlapping_shells(5, 6, {32, 32});
     }},
    {"cloud",
     [] {
         return reference::cloud_small(150000, true, 1, {48, 32});
     }},
    {"instances", [] { return swarm(120000); }},
};

void PrintTo(const BakedCase& c, std::ostream* out) { *out << c.name; }

class BakedOutOfCore : public testing::TestWithParam<BakedCase> {
protected:
    struct Outcome {
        uint64_t hash, rays;
    };

    Outcome render_baked(const Scene& scene, uint64_t host_limit, const char* name, uint64_t& buckets) const {
        BakeOptions options;
        options.block_bytes = 128 << 10;
        options.host_limit = host_limit;
        const auto path = folder_.path() / name;
        const auto summary = bake(scene, options, path);
        EXPECT_TRUE(summary.ok()) << summary.status().message();
        const auto file = BlockFile::open(path);
        EXPECT_TRUE(file.ok()) << file.status().message();
        if (!summary || !file) return {};
        buckets = summary->buckets;
        RenderOptions render_options;
        render_options.spp = 4;
        render_options.geometry_limit_percent = 50;
        const auto result = render(**file, render_options, {});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result ? Outcome{result->report.film_hash, result->report.rays.total()} : Outcome{};
    }

    support::TemporaryFolder folder_;
};

TEST_P(BakedOutOfCore, shows_the_same_picture) {
    const Scene scene = GetParam().make();
    uint64_t buckets = 0;
    const Outcome in_memory = render_baked(scene, uint64_t{4} << 30, "a.rpb", buckets);
    EXPECT_EQ(buckets, 0u);
    const Outcome over_disk = render_baked(scene, smallest_bake_limit(), "b.rpb", buckets);
    EXPECT_GT(buckets, 1u) << "the scene fits into the smallest limit; make it larger";
    EXPECT_EQ(over_disk.hash, in_memory.hash);
    EXPECT_EQ(over_disk.rays, in_memory.rays);
    EXPECT_GT(in_memory.rays, 1000u);
}

INSTANTIATE_TEST_SUITE_P(scenes, BakedOutOfCore, testing::ValuesIn(baked_cases), [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace raypager
