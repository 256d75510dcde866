// A cloud that is too large for memory -> spheres and points of the world: the same ones that place_cloud makes.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "clouds/point_cloud.hpp"
#include "raypager/scene.hpp"
#include "world/bake_memory.hpp"
#include "world/records.hpp"

namespace raypager {

struct CloudStream {
    BakeMemory memory;
    std::filesystem::path spill_beside;
    const std::atomic<bool>* stop = nullptr;
    // Takes each sphere of the cloud once, in any order. Their ids are their numbers in the order of the source; take may change them.
    // bounds: of these spheres. Always called by the same thread.
    std::function<Status(std::span<SphereRecord> spheres, const Box& bounds)> take;
    std::function<void(double fraction)> progress;  // may be empty
};

struct StreamedCloud {
    uint64_t spheres = 0, culled = 0, merged = 0;  // see PlacedCloud
};

// The source is read twice. Where radii follow from the spacing, or points of the same pixel are merged, points are sorted on disk, and the
// octree over them is built from cells that fit into memory. Which these are, and the order of the spheres, follows from the points and the limit
// alone, not from the number of threads.
Result<StreamedCloud> stream_cloud(const Shape& shape, const PointRules& rules, const CloudStream& stream, MeshIssues& issues);

}  // namespace raypager
