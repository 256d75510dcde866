// The placements of objects -> records of instances, as a world of their own.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bake/build_world.hpp"
#include "bake/instance_traits.hpp"
#include "bake/nesting.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "world/bake_memory.hpp"
#include "world/instance_record.hpp"
#include "world/records.hpp"
#include "world/world.hpp"

namespace raypager {

struct InstanceGathering {
    BakeMemory memory;
    const std::filesystem::path& spill_beside;  // scratch files come beside this file
    const std::atomic<bool>* stop = nullptr;    // may be null
    std::function<void(double fraction)> progress;
};

struct GatheredInstances {
    World world;                    // with all of them, or, if there are too many for memory, empty:
    std::optional<Bucket> spilled;  // then they are here
    Box bounds;                     // of the boxes of their objects, placed
    uint64_t count = 0;
    uint32_t levels = 0;  // of what is placed: 1, or more where there are instances in that
};

// All instances in the order of their sources, numbered through from first_number on. objects: of each where it is; its box is empty where no ray can
// hit anything of it: its instances are left out. Those that flatten their object, or put it beyond +-1e12, are dropped, with a warning that counts
// them. An error if there is an object that does not exist, a number that is not finite, or 2^32 - 1 instances or more.
// traits: gets those of all that are left; where an object is nothing but lights that are not seen, all that there is of its instances. Null: none
// has any.
Result<GatheredInstances> gather_instances(const InstanceSources& sources, std::span<const ObjectBounds> objects, InstanceTraits* traits,
                                           uint64_t first_number, const InstanceGathering& settings, MeshIssues& issues);

// Instances as blocks.
struct InstanceBlocks {
    std::vector<BlockEntryBox> block_entry_boxes;
    Box bounds;           // as GatheredInstances has it
    uint32_t levels = 0;  // likewise; 0: there are none
};

// What these sources place, as blocks of instances that follow those that are there, of which all know the levels of what they are part of. building:
// as of shapes. buckets: counts those that it took over the disk.
Result<InstanceBlocks> bake_instances(const InstanceSources& sources, std::span<const ObjectBounds> objects, InstanceTraits* traits,
                                      const WorldBuilding& building, const std::function<void(double fraction)>& progress, BlockSink& sink,
                                      BakedScene& baked, MeshIssues& issues, uint64_t& buckets);

}  // namespace raypager
