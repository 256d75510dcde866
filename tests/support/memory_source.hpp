// Blocks in memory, as peers might hold them: a source that is no file.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "store/block_source.hpp"

namespace raypager::support {

class MemorySource : public BlockSource {
public:
    // Takes over everything that a source has.
    static Result<MemorySource> copy_of(const BlockSource& source);
    const BakedScene& scene() const override { return scene_; }
    std::vector<std::byte>& block(uint32_t index) { return blocks_[index]; }
    // Fetching this block fails from now on.
    void lose(uint32_t index) { lost_ = index; }

private:
    Status fetch(uint32_t block, std::span<std::byte> stored) const override;
    Status damaged(uint32_t block, const std::string& what) const override;

    BakedScene scene_;
    std::vector<std::vector<std::byte>> blocks_;  // and behind them pages
    uint32_t lost_ = UINT32_MAX;
};

}  // namespace raypager::support
