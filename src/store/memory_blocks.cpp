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

Status MemoryBlocks::finish(const BakedScene& scene) {
    scene_ = scene;
    return check_scene(scene_, end_).at("baked scene");
}

Status MemoryBlocks::fetch(uint32_t block, std::span<std::byte> stored) const {
    std::ranges::copy(blocks_[block], stored.begin());
    return {};
}

Status MemoryBlocks::damaged(uint32_t block, const std::string& what) const {
    return Status::failed(fmt::format("block {} in memory is damaged: {}", block, what));
}

}  // namespace raypager
