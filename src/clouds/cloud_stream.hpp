// A cloud that is too large for memory -> spheres and points of the world: the same ones that place_cloud makes.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "clouds/point_cloud.hpp"
#include "raypager/scene.hpp"
#include "world/bake_memory.hpp"

namespace raypager {

struct CloudStream {
    BakeMemory memory;
    std::filesystem::path spill_beside;
    const std::atomic<bool>* stop = nullptr;
    // Takes each sphere of the cloud once, in any order. rank: its number in the order of the source.
    std::function<Status(const WorldSphere& sphere, uint64_t rank)> take;
    std::function<void(double fraction)> progress;  // may be empty
};

struct StreamedCloud {
    uint64_t spheres = 0, culled = 0, merged = 0;  // see PlacedCloud
};

// The source is read twice. Where radii follow from the spacing, or points of the same pixel are merged, points are sorted on disk, and the
// octree over them is built from cells that fit into memory.
Result<StreamedCloud> stream_cloud(const Shape& shape, const PointRules& rules, const CloudStream& stream, MeshIssues& issues);

}  // namespace raypager
