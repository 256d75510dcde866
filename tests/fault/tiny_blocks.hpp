// Hundreds of tiny blocks, and a disk whose operations and uploads can be made to wait.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/failing_device.hpp"
#include "support/failing_file_system.hpp"
#include "support/sanitizers.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_options.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {

// Blocks wait before they are uploaded, as files do, and threads that have done it before they go on.
class SlowUploads final : public DeviceHooks {
public:
    explicit SlowUploads(support::FailingFileSystem& disk) : disk_(disk) {}
    void before_upload() override { disk_.delay(); }
    void after_upload() override { disk_.delay(); }

private:
    support::FailingFileSystem& disk_;
};

class TinyBlocks : public testing::Test {
protected:
#if RAYPAGER_ADDRESS_SANITIZER || RAYPAGER_THREAD_SANITIZER
    static constexpr uint32_t triangles = 30000, min_blocks = 200;  // sanitizers cost five to twenty times the time
#else
    static constexpr uint32_t triangles = 100000, min_blocks = 600;
#endif

    void SetUp() override {
        Scene scene = blocks_test::scene_of({blocks_test::mesh_shape(blocks_test::soup(triangles, 1, 0.004f))});
        rp_light sky = {};
        sky.kind = RP_LIGHT_INFINITE;
        sky.radiance[0] = sky.radiance[1] = sky.radiance[2] = 1;
        scene.lights = {sky};
        scene.width = 16;
        scene.height = 8;
        scene.spp = 1;
        scene.max_depth = 2;
        BakeOptions bake_options;
        bake_options.block_bytes = 16 << 10;
        bake_options.block_entries = 8;
        auto file = support::bake_and_open(scene, bake_options, folder_.path(), "tiny");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
        ASSERT_GE(file_->scene().blocks.size(), min_blocks);
        options_.tuning.paths = 128;
        options_.instruments.device_hooks = std::make_shared<SlowUploads>(disk_);
        const auto resident = render(*file_, options_, {});
        ASSERT_TRUE(resident.ok()) << resident.status().message();
        hash_ = resident->report.film_hash;
    }

    support::TemporaryFolder folder_;
    support::FailingFileSystem disk_;
    std::shared_ptr<const BlockFile> file_;
    support::TestOptions options_;
    uint64_t hash_ = 0;
};

}  // namespace raypager
