#include "bake/build_world.hpp"

#include "cut/distribute.hpp"
#include "cut/world_cut.hpp"

namespace raypager {
namespace {

Status build_bucket(const Bucket& bucket, uint32_t first_id, const WorldBuilding& building, BlockBuilder& builder,
                    const std::function<void(double)>& progress) {
    auto world = load_bucket(bucket);
    if (!world) return world.status();
    world->first_id = first_id;
    // Instances have no vertices to compare.
    const Weigher weigher(*world, world->instances.empty() ? Weigher::Sharing::by_value : Weigher::Sharing::by_index);
    const WorldParts parts = WorldCut(*world, weigher).run(building.blocks.block_bytes, building.memory.cut);
    return builder.build(*world, weigher, parts, progress);
}

}  // namespace

Result<std::vector<BlockEntryBox>> build_in_memory(const World& world, const SettleBuilding& settle, const GatherProgress& progress, BlockSink& sink,
                                                   BakedScene& baked) {
    progress("cut", 0);
    const Weigher weigher(world, Weigher::Sharing::by_index);
    WorldCut cut(world, weigher);
    const auto building = settle(cut.weight());
    if (!building) return building.status();
    const WorldParts parts = std::move(cut).run(building->blocks.block_bytes, building->memory.cut);
    progress("cut", 1);
    BlockBuilder builder(building->blocks, sink, baked);
    RAYPAGER_TRY(builder.build(world, weigher, parts, [&](double fraction) { progress("build", fraction); }));
    return builder.block_entry_boxes();
}

Result<std::vector<BlockEntryBox>> build_from_disk(Bucket all, uint32_t first_id, uint64_t weight, const SettleBuilding& settle,
                                                   const GatherProgress& progress, BlockSink& sink, BakedScene& baked, uint64_t& buckets) {
    const auto building = settle(weight);
    if (!building) return building.status();
    const BakeMemory& memory = building->memory;
    const DistributeSettings settings = {memory, building->spill_beside, building->blocks.stop,
                                         [&](double fraction) { progress("distribute", fraction); }};
    BlockBuilding blocks = building->blocks;
    blocks.builders = memory.bucket_builders;
    BlockBuilder builder(blocks, sink, baked);
    const auto primitives = static_cast<double>(all.primitives());
    std::vector<Bucket> stack;
    stack.push_back(std::move(all));
    uint64_t built = 0;
    while (!stack.empty()) {
        const Bucket bucket = std::move(stack.back());
        stack.pop_back();
        const uint64_t count = bucket.primitives();
        if (bucket.memory_bytes() > memory.bucket && count >= 2) {
            auto split = distribute(bucket, settings);
            if (!split) return split.status();
            for (auto part = split->rbegin(); part != split->rend(); ++part) stack.push_back(std::move(*part));
            continue;
        }
        RAYPAGER_TRY(build_bucket(bucket, first_id, *building, builder, [&](double fraction) {
            progress("build", (static_cast<double>(built) + fraction * static_cast<double>(count)) / primitives);
        }));
        built += count;
        buckets++;
    }
    return builder.block_entry_boxes();
}

Result<std::vector<BlockEntryBox>> build_gathered(Gathered& gathered, const SettleBuilding& settle, const GatherProgress& progress, BlockSink& sink,
                                                  BakedScene& baked, uint64_t& buckets) {
    if (!gathered.spilled) return build_in_memory(gathered.world, settle, progress, sink, baked);
    return build_from_disk(std::move(*gathered.spilled), gathered.world.first_id, gathered.weight, settle, progress, sink, baked, buckets);
}

}  // namespace raypager
