#include "residency/transcode.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.hpp"
#include "block/wide_block.hpp"

namespace raypager {

Status transcode_block(const BakedScene& scene, uint32_t block, BlockForm form, std::span<std::byte> bytes) {
    const BlockRecord& record = scene.blocks[block];
    RAYPAGER_CHECK(bytes.size() >= std::max(record.stored_bytes, record.bytes(form)));
    if (form == BlockForm::stored) return {};
    const BlockEntryRoots block_entries = scene.block_entries_of(block);
    WideBlockMaker maker;
    const std::span<const std::byte> made = maker.make(bytes.first(record.stored_bytes), block_entries.roots);
    // The top tree leads to the roots that the file names: they must be those of the tree that was just made.
    if (made.size() != record.wide_bytes || !std::ranges::equal(maker.roots(), block_entries.wide_roots))
        return Status::failed(fmt::format("block {} does not take the form in a CPU's memory that the block file says; bake the scene again", block));
    std::ranges::copy(made, bytes.begin());
    return {};
}

}  // namespace raypager
