// The placements of objects -> records of instances, as a world of their own.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <vector>

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
};

// All instances in the order of their sources, numbered through. objects: of each where it is; its box is empty where no ray can hit anything of it:
// its instances are left out. Those that flatten their object, or put it beyond +-1e12, are dropped, with a warning that counts them. An error if
// there is an object that does not exist, a number that is not finite, or 2^32 - 1 instances or more.
Result<GatheredInstances> gather_instances(const Scene& scene, std::span<const ObjectBounds> objects, const InstanceGathering& settings,
                                           MeshIssues& issues);

}  // namespace raypager
