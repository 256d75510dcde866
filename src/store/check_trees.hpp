// Whether the trees above the blocks hold together: that of the world, and those of objects.
#pragma once

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Every block entry is reached once, by its path, and by the tree of what its block belongs to. REQUIRES: block entries that are in order.
Status check_trees(const BakedScene& scene);

}  // namespace raypager
