#include "support/memory_source.hpp"

#include <algorithm>

namespace raypager::support {

Result<MemorySource> MemorySource::copy_of(const BlockSource& source) {
    MemorySource copy;
    copy.scene_ = source.scene();
    for (uint32_t i = 0; i < copy.scene_.blocks.size(); i++) {
        copy.blocks_.emplace_back(copy.scene_.blocks[i].stored_bytes);
        RAYPAGER_TRY(source.read_block(i, copy.blocks_.back()));
        copy.scene_.blocks[i].offset = UINT64_MAX;  // says nothing here
    }
    for (uint32_t i = 0; i < copy.scene_.pages.size(); i++) {
        copy.blocks_.emplace_back(RP_TEXTURE_PAGE_BYTES);
        RAYPAGER_TRY(source.read_page(i, copy.blocks_.back()));
        copy.scene_.pages[i].offset = UINT64_MAX;
    }
    return copy;
}

Status MemorySource::fetch(uint32_t block, std::span<std::byte> stored) const {
    if (block == lost_) return Status::failed("block " + std::to_string(block) + ": its holder does not answer");
    std::ranges::copy(blocks_[block], stored.begin());
    return {};
}

Status MemorySource::damaged(uint32_t block, const std::string& what) const {
    return Status::failed("block " + std::to_string(block) + " in memory: " + what);
}

}  // namespace raypager::support
