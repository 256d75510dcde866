// Parts of the world -> blocks in the file.
#pragma once

#include <atomic>
#include <functional>
#include <span>
#include <vector>

#include "cut/top_tree.hpp"
#include "cut/world_cut.hpp"
#include "pack/pack.hpp"
#include "store/block_sink.hpp"
#include "world/world.hpp"

namespace raypager {

struct BlockBuilding {
    uint64_t block_bytes;           // at most, in memory format
    uint32_t max_entries;           // per block
    size_t builders;                // blocks that are made at a time
    const std::atomic<bool>* stop;  // may be null
};

class BlockBuilder {
public:
    BlockBuilder(const BlockBuilding& settings, BlockSink& sink, BakedScene& baked) : settings_(settings), sink_(sink), baked_(baked) {}
    // Builds a block of each part, or several where its bytes were underestimated, and appends them in order.
    Status build(const World& world, const Weigher& weigher, const WorldParts& parts, const std::function<void(double)>& progress);
    // Of all block entries so far.
    const std::vector<BlockEntryBox>& block_entry_boxes() const { return block_entry_boxes_; }

private:
    class Run;
    Status append(PackedBlock& block);

    const BlockBuilding settings_;
    BlockSink& sink_;
    BakedScene& baked_;
    std::vector<BlockEntryBox> block_entry_boxes_;
};

}  // namespace raypager
