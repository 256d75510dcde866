// A baked scene whose blocks and pages stay in host memory.
#pragma once

#include <memory>
#include <vector>

#include "store/block_sink.hpp"
#include "store/block_source.hpp"
#include "store/format.hpp"

namespace raypager {

class MemoryBlocks final : public BlockSink, public BlockSource {
public:
    Status append(std::span<const std::byte> stored, BlockRecord& record) override;
    Status reserve_pages(uint32_t count) override;
    Status put_page(uint32_t page, std::span<const std::byte> bytes, PageRecord& record) override;
    // Checked as a file is when it is opened.
    Status finish(const BakedScene& scene) override;
    const BakedScene& scene() const override { return scene_; }

private:
    Status fetch(uint32_t pageable, std::span<std::byte> stored) const override;
    Status damaged(uint32_t pageable, const std::string& what) const override;

    BakedScene scene_;
    std::vector<std::vector<std::byte>> blocks_, pages_;
    uint64_t pages_at_ = 0;
    uint64_t end_ = format::page;  // where a file would go on, behind its header
};

}  // namespace raypager
