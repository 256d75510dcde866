// What was gathered -> blocks, in memory or over the disk.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "bake/build_blocks.hpp"
#include "gather/gather.hpp"
#include "world/bake_memory.hpp"
#include "world/records.hpp"

namespace raypager {

struct WorldBuilding {
    BlockBuilding blocks;
    BakeMemory memory;
    std::filesystem::path spill_beside;  // scratch files come beside this file
};
// How it is done, once it is known how many bytes about there will be in blocks.
using SettleBuilding = std::function<Result<WorldBuilding>(uint64_t weight)>;

// Appends blocks and block entries to the sink and to what is baked; returns the boxes of the block entries.
Result<std::vector<BlockEntryBox>> build_in_memory(const World& world, const SettleBuilding& settle, const GatherProgress& progress, BlockSink& sink,
                                                   BakedScene& baked);
// Splits what is too large until it fits into memory, depth first: the blocks come in the order of the cuts. first_id: as of World. weight: about so
// many bytes in blocks. buckets: counts those that were built.
Result<std::vector<BlockEntryBox>> build_from_disk(Bucket all, uint32_t first_id, uint64_t weight, const SettleBuilding& settle,
                                                   const GatherProgress& progress, BlockSink& sink, BakedScene& baked, uint64_t& buckets);
// One or the other. What is on disk is used up.
Result<std::vector<BlockEntryBox>> build_gathered(Gathered& gathered, const SettleBuilding& settle, const GatherProgress& progress, BlockSink& sink,
                                                  BakedScene& baked, uint64_t& buckets);

}  // namespace raypager
