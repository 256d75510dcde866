// Where things stand and lie on an island.
#pragma once

#include "procedural/island_land.hpp"
#include "procedural/island_plan.hpp"
#include "procedural/layers.hpp"

namespace raypager {

// The instances of all things, their origin the land's eye; as many of each as planned.
Status write_island_layers(SceneWriter& scene, const IslandPlan& plan, const IslandLand& land, uint64_t seed);

}  // namespace raypager
