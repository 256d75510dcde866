#include "store/block_source.hpp"

#include "base/check.hpp"
#include "base/hash.hpp"
#include "block/check_block.hpp"

namespace raypager {

Status BlockSource::read_block(uint32_t block, std::span<std::byte> stored) const {
    RAYPAGER_CHECK(block < scene().blocks.size());
    const BlockRecord& record = scene().blocks[block];
    RAYPAGER_CHECK(stored.size() == record.stored_bytes);
    return read(block, stored);
}

Status BlockSource::read_page(uint32_t page, std::span<std::byte> bytes) const {
    RAYPAGER_CHECK(page < scene().pages.size() && bytes.size() == RP_TEXTURE_PAGE_BYTES);
    const auto pageable = static_cast<uint32_t>(scene().blocks.size() + page);
    return read(pageable, bytes);
}

Status BlockSource::read(uint32_t pageable, std::span<std::byte> stored) const {
    RAYPAGER_TRY(fetch(pageable, stored));
    return fetches_verified() || hash64(stored) == checksum_of(pageable) ? Status() : damaged(pageable, "the checksum is wrong");
}

Status BlockSource::check_block(uint32_t block, std::span<const std::byte> stored) const {
    RAYPAGER_CHECK(block < scene().blocks.size());
    const Status status = check_block_bytes(scene(), block, stored);
    return status.ok() ? status : damaged(block, status.message());
}

}  // namespace raypager
