// The placements of objects -> records of instances, as a world of their own.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bake/instance_traits.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "world/instance_record.hpp"
#include "world/world.hpp"

namespace raypager {

struct InstanceGathering {
    uint64_t memory_bytes = UINT64_MAX;       // that they may take
    const std::atomic<bool>* stop = nullptr;  // may be null
    std::function<void(double fraction)> progress;
};

// What an instance takes while it is cut into blocks, in bytes.
inline constexpr uint64_t instance_memory = sizeof(WorldInstance) + sizeof(Triangle) + cut_memory;

// All instances in the order of their sources, numbered through. objects: of each where it is; its box is empty where no ray can hit anything of it:
// its instances are left out. Those that flatten their object, or put it beyond +-1e12, are dropped, with a warning that counts them. An error if
// there is an object that does not exist, a number that is not finite, or too many for the memory. traits: gets those of all that are left; where an
// object is nothing but lights that are not seen, all that there is of its instances.
Result<World> gather_instances(const Scene& scene, std::span<const ObjectBounds> objects, const InstanceGathering& settings, InstanceTraits& traits,
                               MeshIssues& issues);

}  // namespace raypager
