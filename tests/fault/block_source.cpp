// Renders from a source of blocks that is no file: the same picture, and the same care with what it hands over.
#include <gtest/gtest.h>

#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/memory_source.hpp"
#include "support/small_scene_file.hpp"

namespace raypager {
namespace {

class BlockSources : public support::SmallSceneFile {
protected:
    void SetUp() override {
        ASSERT_GT(file_->scene().blocks.size(), 4u);
        auto memory = support::MemorySource::copy_of(*file_);
        ASSERT_TRUE(memory.ok()) << memory.status().message();
        memory_.emplace(std::move(*memory));
        options_.spp = 8;
        options_.width = 24;
        options_.height = 16;
        options_.geometry_limit_percent = 40;
    }

    void expect_failure(const std::string& named) const {
        const auto result = render(*memory_, options_, {});
        ASSERT_FALSE(result.ok());
        EXPECT_EQ(result.status().exit_code(), 1);
        EXPECT_NE(result.status().message().find(named), std::string::npos) << result.status().message();
    }

    std::optional<support::MemorySource> memory_;
    RenderOptions options_;
};

TEST_F(BlockSources, draw_the_same_picture) {
    for (const Traversal traversal : support::traversals()) {
        options_.tuning.traversal = traversal;
        const auto from_file = render(*file_, options_, {}), from_memory = render(*memory_, options_, {});
        ASSERT_TRUE(from_file.ok()) << from_file.status().message();
        ASSERT_TRUE(from_memory.ok()) << from_memory.status().message();
        EXPECT_EQ(from_file->report.film_hash, from_memory->report.film_hash);
        EXPECT_GT(from_memory->report.paging.evictions, 0u);
    }
}

TEST_F(BlockSources, are_checked) {
    memory_->block(2)[100] ^= std::byte{1};
    expect_failure("block 2 in memory: the checksum is wrong");
    memory_->block(2)[100] ^= std::byte{1};
    memory_->lose(3);
    expect_failure("block 3: its holder does not answer");
}

}  // namespace
}  // namespace raypager
