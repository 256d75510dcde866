#include "store/memory_blocks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "store/check_scene.hpp"

namespace raypager {

// Offsets are those that a file would have: check_scene checks them.
Status MemoryBlocks::append(std::span<const std::byte> stored, BlockRecord& record) {
    RAYPAGER_CHECK(!stored.empty() && stored.size() <= UINT32_MAX);
    record.offset = end_;
    record.checksum = hash64(stored);
    record.stored_bytes = static_cast<uint32_t>(stored.size());
    end_ = (end_ + stored.size() + format::page - 1) / format::page * format::page;
    blocks_.emplace_back(stored.begin(), stored.end());
    return {};
}

Status MemoryBlocks::reserve_pages(uint32_t count) {
    pages_at_ = end_;
    end_ += uint64_t{count} * RP_TEXTURE_PAGE_BYTES;
    pages_.resize(count);
    return {};
}

Status MemoryBlocks::put_page(uint32_t page, std::span<const std::byte> bytes, PageRecord& record) {
    RAYPAGER_CHECK(page < pages_.size() && bytes.size() == RP_TEXTURE_PAGE_BYTES);
    record.offset = pages_at_ + uint64_t{page} * RP_TEXTURE_PAGE_BYTES;
    record.checksum = hash64(bytes);
    pages_[page].assign(bytes.begin(), bytes.end());
    return {};
}

Status MemoryBlocks::finish(const BakedScene& scene) {
    scene_ = scene;
    return check_scene(scene_, end_).at("baked scene");
}

Status MemoryBlocks::fetch(uint32_t pageable, std::span<std::byte> stored) const {
    std::ranges::copy(scene_.is_page(pageable) ? pages_[pageable - blocks_.size()] : blocks_[pageable], stored.begin());
    return {};
}

Status MemoryBlocks::damaged(uint32_t pageable, const std::string& what) const {
    return Status::failed(fmt::format("{} in memory is damaged: {}", scene_.pageable_name(pageable), what));
}

}  // namespace raypager
