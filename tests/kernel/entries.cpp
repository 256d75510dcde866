// What kernels tell of the use of blocks, each in its own way (RP_DEMAND_USED).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "raypager/abi/path.h"
#include "support/device_scene.hpp"
#include "support/small_scene.hpp"

namespace raypager {
namespace {

using support::ProbeRay;

class Entries : public testing::TestWithParam<Traversal> {
protected:
    // Rays from all sides to the middle of a scene of one block: single ones enter it, for the closest hit and once more for any hit.
    void SetUp() override {
        BakeOptions options;
        options.block_bytes = 1 << 20;
        auto file = support::bake_and_open(support::small_scene(6), options, folder_.path(), "small");
        ASSERT_TRUE(file.ok()) << file.status().message();
        ASSERT_EQ((*file)->scene().blocks.size(), 1u);
        auto scene = support::DeviceScene::create(*file, 0, GetParam());
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        scene_ = std::move(*scene);
        block_entries_ = static_cast<uint32_t>((*file)->scene().block_entries.size());
        const rp_top_grid& grid = (*file)->scene().top_grid;
        std::mt19937 random(7);
        std::normal_distribution<float> normal;
        for (const auto& [to, origin, cell] :
             {std::tuple(&middle_.x, grid.origin[0], grid.cell[0]), std::tuple(&middle_.y, grid.origin[1], grid.cell[1]),
              std::tuple(&middle_.z, grid.origin[2], grid.cell[2])})
            *to = origin + 32768 * cell;
        for (uint32_t i = 0; i < count; i++) {
            const Float3 away = {normal(random), normal(random), normal(random)};
            const float length = std::sqrt(away.x * away.x + away.y * away.y + away.z * away.z);
            const Float3 unit = {away.x / length, away.y / length, away.z / length};
            rays_.push_back({{middle_.x + 50 * unit.x, middle_.y + 50 * unit.y, middle_.z + 50 * unit.z}, INFINITY, {-unit.x, -unit.y, -unit.z}});
        }
    }

    uint32_t use(const std::string& definitions) {
        const auto hits = scene_->trace(rays_, definitions);
        EXPECT_TRUE(hits.ok()) << hits.status().message();
        hits_ = static_cast<uint32_t>(std::count_if(hits->begin(), hits->end(), [](const support::ProbeHit& hit) { return std::isfinite(hit.t); }));
        uint32_t word = 0;
        EXPECT_TRUE(scene_->device()
                        .kernels()
                        .read_now(scene_->geometry().demand(), RP_DEMAND_USED * sizeof(uint32_t), std::as_writable_bytes(std::span(&word, 1)))
                        .ok());
        return word;
    }

    void expect_an_eighth() {
        const uint32_t before = use(""), all = use(" -DRP_TRACK_ENTERS=0u") - before, sample = use(" -DRP_TRACK_ENTERS=7u") - before - all;
        // Rays, or streams of 64 of them, that are in the sample or not; each enters twice. Five standard deviations of that.
        const double unit = GetParam() == Traversal::ray ? 1 : 64, expected = all / 8.0, tolerance = 5 * std::sqrt(expected * unit * 2);
        EXPECT_LT(tolerance, expected);
        EXPECT_NEAR(sample, expected, tolerance);
    }

    static constexpr uint32_t count = 65536;
    support::TemporaryFolder folder_;
    std::unique_ptr<support::DeviceScene> scene_;
    std::vector<ProbeRay> rays_;
    Float3 middle_;
    uint32_t block_entries_ = 0, hits_ = 0;
};

TEST_P(Entries, none_are_told_unless_asked_for) { EXPECT_EQ(use(""), 0u); }

TEST_P(Entries, the_round_of_the_last_one) { EXPECT_EQ(use(" -DRP_TRACK_LAST_ROUND"), 1u); }

TEST_P(Entries, all_are_counted) {
    const uint32_t entries = use(" -DRP_TRACK_ENTERS=0u");
    if (GetParam() == Traversal::ray) {
        EXPECT_EQ(entries, 2 * count);
    } else {
        // Streams enter a block by those of its block entries that they meet.
        EXPECT_GE(entries, 2 * hits_);
        EXPECT_GT(hits_, count / 8);
        EXPECT_LE(entries, 2 * count * block_entries_);
    }
    EXPECT_EQ(use(" -DRP_TRACK_ENTERS=0u"), 2 * entries) << "they add up";
}

TEST_P(Entries, a_sample_is_as_large_as_it_should_be) { expect_an_eighth(); }

// As to the sun: directions tell them no more apart. Along an axis two reciprocals are the same.
TEST_P(Entries, a_sample_of_parallel_rays) {
    for (const Float3& direction : {Float3{0, 0, 1}, Float3{0.6f, 0.48f, 0.64f}}) {
        for (ProbeRay& ray : rays_) {
            const Float3 away = {ray.direction.x, ray.direction.y, ray.direction.z};
            ray.origin = {middle_.x + 2 * away.x - 50 * direction.x, middle_.y + 2 * away.y - 50 * direction.y,
                          middle_.z + 2 * away.z - 50 * direction.z};
        }
        std::vector<ProbeRay> scattered = rays_;
        for (ProbeRay& ray : rays_) ray.direction = direction;
        expect_an_eighth();
        rays_ = std::move(scattered);
    }
}

INSTANTIATE_TEST_SUITE_P(traversal, Entries, testing::ValuesIn(support::traversals()),
                         [](const auto& tested) { return std::string(tested.param == Traversal::ray ? "ray" : "stream"); });

}  // namespace
}  // namespace raypager
