// Pages of images come and go as blocks do, within the same limits.
#include <gtest/gtest.h>

#include <utility>

#include "device/device.hpp"
#include "raypager/abi/path.h"
#include "raypager/bake.hpp"
#include "render/render.hpp"
#include "residency/residency.hpp"
#include "support/device_scene.hpp"
#include "support/test_options.hpp"
#include "support/textured_scene.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

class ImagePagesOnDevice : public ::testing::TestWithParam<BlockForm> {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
    }
    void bake_scene(const Scene& scene) {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        auto baked = bake(scene, options);
        ASSERT_TRUE(baked.ok()) << baked.status().message();
        blocks_.emplace(baked->blocks);
    }
    const BakedScene& scene() const { return blocks_->source().scene(); }
    void make_residency(uint64_t pool_bytes) {
        ResidencySettings settings;
        settings.form = GetParam();
        settings.pool_bytes = pool_bytes;
        settings.host_limit = pool_bytes;
        settings.policy = default_settings(PolicyKind::aged_wants);
        auto residency = Residency::create(*device_, blocks_->source(), settings);
        ASSERT_TRUE(residency.ok()) << residency.status().message();
        residency_ = std::move(*residency);
        round_ = 0;
        ASSERT_TRUE(residency_->publish(device_->kernels()).ok());
    }
    bool is_resident(uint32_t pageable) const { return residency_->blocks()[pageable].state == PageState::resident; }
    // Rounds in which one ray waits for this, until it is there.
    void want(uint32_t pageable) {
        for (int tries = 0; !is_resident(pageable); tries++) {
            ASSERT_LT(tries, 100) << "it never came";
            round_++;
            std::vector<rp_block_demand> demand = {{pageable, 1, 0, 0}};
            if (wanted_ != pageable) demand.push_back({std::exchange(wanted_, pageable), 0, 0, 0});
            residency_->take_demand(round_, demand);
            ASSERT_TRUE(residency_->after_round(round_, round_, Event(), 0, 1).ok());
            const auto arrived = residency_->wait_for_block(round_);
            ASSERT_TRUE(arrived.ok()) << arrived.status().message();
            ASSERT_TRUE(residency_->publish(device_->kernels()).ok());
        }
    }
    std::vector<std::byte> bytes_on_device(uint32_t page) {
        const PoolAddress address = residency_->blocks()[scene().blocks.size() + page].address;
        EXPECT_EQ(address.offset % RP_BLOCK_ALIGNMENT, 0u);
        std::vector<std::byte> bytes(RP_TEXTURE_PAGE_BYTES);
        EXPECT_TRUE(device_->kernels().read_now(residency_->slabs()[address.slab], address.offset, bytes).ok());
        return bytes;
    }
    void expect_page(uint32_t page) {
        std::vector<std::byte> bytes(RP_TEXTURE_PAGE_BYTES);
        ASSERT_TRUE(blocks_->source().read_page(page, bytes).ok());
        EXPECT_EQ(bytes_on_device(page), bytes) << "page " << page;
    }
    uint32_t pageable(uint32_t page) const { return static_cast<uint32_t>(scene().blocks.size()) + page; }

    std::unique_ptr<Device> device_;
    std::optional<Blocks> blocks_;
    std::unique_ptr<Residency> residency_;
    uint32_t round_ = 0, wanted_ = 0;
};

Scene textured_terrain_of(uint32_t n) {
    Scene scene = support::with_images(n ? scene_of({mesh_shape(terrain(n))}) : scene_of({}));
    scene.width = 64;
    scene.height = 36;
    return scene;
}

TEST_P(ImagePagesOnDevice, ComeWhenTheyAreWantedAndGoForOthers) {
    bake_scene(textured_terrain_of(40));
    ASSERT_GT(scene().blocks.size(), 2u);
    const uint64_t room = 2 * scene().largest_pageable(GetParam());
    make_residency(room);
    for (uint32_t page = 0; page < scene().pages.size(); page++) {
        want(pageable(page));
        expect_page(page);
        want(page % 2);  // a block
        EXPECT_LE(residency_->resident_bytes(), room);
    }
    want(pageable(0));
    expect_page(0);
    EXPECT_GT(residency_->statistics().evictions, 0u);
    EXPECT_LE(residency_->statistics().peak_resident_bytes, room);
}

TEST_P(ImagePagesOnDevice, RoomForOneIsEnough) {
    bake_scene(textured_terrain_of(0));
    EXPECT_EQ(scene().largest_pageable(GetParam()), RP_TEXTURE_PAGE_BYTES);
    make_residency(RP_TEXTURE_PAGE_BYTES);
    for (uint32_t page = 0; page < scene().pages.size(); page++) {
        want(pageable(page));
        expect_page(page);
        EXPECT_EQ(residency_->resident_bytes(), RP_TEXTURE_PAGE_BYTES);
    }
}

TEST_P(ImagePagesOnDevice, AllFitWhereThereIsRoomForAll) {
    for (const uint32_t n : {0u, 20u}) {
        bake_scene(textured_terrain_of(n));
        make_residency(scene().memory_bytes(GetParam()));
        ASSERT_TRUE(residency_->load_all(device_->kernels()).ok());
        EXPECT_EQ(residency_->resident_bytes(), scene().memory_bytes(GetParam()));
        for (uint32_t page = 0; page < scene().pages.size(); page++) expect_page(page);
    }
}

// Renders end, and draw the same, whatever is resident: of geometry and images together, or of images alone.
TEST_P(ImagePagesOnDevice, RendersKeepTheLimitAndThePicture) {
    if (GetParam() == BlockForm::wide && support::traversals().size() == 1) GTEST_SKIP() << "this device traces no streams";
    for (const uint32_t n : {0u, 20u}) {
        bake_scene(textured_terrain_of(n));
        support::TestOptions options;
        options.spp = 1;
        options.tuning.paths = 64;
        options.tuning.traversal = GetParam() == BlockForm::wide ? Traversal::stream : Traversal::ray;
        const auto resident = render(blocks_->source(), options, {});
        ASSERT_TRUE(resident.ok()) << resident.status().message();
        options.geometry_limit = scene().largest_pageable(GetParam());
        const auto paged = render(blocks_->source(), options, {});
        ASSERT_TRUE(paged.ok()) << paged.status().message();
        EXPECT_EQ(paged->report.film_hash, resident->report.film_hash);
        EXPECT_LE(paged->report.peak.geometry_bytes, options.geometry_limit);
        options.geometry_limit = RP_TEXTURE_PAGE_BYTES - 64;
        EXPECT_FALSE(render(blocks_->source(), options, {}).ok());
    }
}

INSTANTIATE_TEST_SUITE_P(Forms, ImagePagesOnDevice, ::testing::Values(BlockForm::stored, BlockForm::wide),
                         [](const auto& form) { return form.param == BlockForm::wide ? "wide" : "stored"; });

}  // namespace
}  // namespace raypager
