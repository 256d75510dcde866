// The objects of a scene -> blocks, and a tree over those of each.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "bake/build_world.hpp"
#include "bake/instance_traits.hpp"
#include "bake/nesting.hpp"
#include "cut/top_tree.hpp"
#include "raypager/bake.hpp"
#include "raypager/scene.hpp"
#include "world/instance_record.hpp"

namespace raypager {

// The tree over the blocks of an object, and where it is, in its own space.
struct ObjectTree {
    TopTree tree;
    uint64_t first_block_entry = 0;
    ObjectBounds bounds;
    ObjectLights lights;
    uint32_t first_range = 0;
};

struct ObjectBaking {
    const Scene& scene;
    const std::vector<InstanceSources>& instances;  // of each object
    PointOptions points;
    WorldBuilding building;  // with the memory that objects may take
    std::function<void(double fraction)> progress;
};

// Appends the blocks of all objects, in their order, and what else a baked scene has of their primitives, whose ids follow those that are there.
// Small objects are made side by side, as many as the memory is enough for; large ones one after the other. What comes out does not depend on that.
// Instances of an object become blocks behind those of its shapes. buckets: counts those that it took over the disk.
Result<std::vector<ObjectTree>> bake_objects(const ObjectBaking& baking, BlockSink& sink, BakedScene& baked, MeshIssues& issues, uint64_t& buckets);

}  // namespace raypager
