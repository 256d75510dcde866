// Which instances lie in objects, and which are put where those objects are placed instead.
#pragma once

#include <memory>
#include <vector>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

using InstanceSources = std::vector<std::shared_ptr<const InstanceSource>>;

struct Nesting {
    InstanceSources of_world;
    std::vector<InstanceSources> of_objects;
};

// What an object places is put where the object is placed instead, as long as that makes at most `few` instances, or no more than there would be
// otherwise: rays find them sooner so, in streams, too. It is as well where instances would lie in each other more than max_levels deep, least first.
// An error if an object places one that does not come before it, or if there are 2^32 - 1 instances or more.
Result<Nesting> plan_nesting(const Scene& scene, uint32_t max_levels, uint64_t few);

}  // namespace raypager
